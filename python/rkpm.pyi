"""Rubber parts under large deformation by the Reproducing Kernel Particle Method."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from os import PathLike
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

_Array = NDArray[np.float64]
_Csr = tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.int32]]
_Part = str | tuple[int, str]
_Place = _Part | Place
_Vector = Sequence[float] | Callable[..., Sequence[float]]
_Body = Block | Region | Solid | Mesh

@final
class Block:
    """A block between two corners, of one, two or three dimensions [length]. Its faces are `(axis, "min")` and `(axis, "max")`."""
    def __new__(cls, min: Sequence[float], max: Sequence[float]) -> Block: ...

class Error(Exception):
    """What the crate refuses or can't find: where, what, and the remedy. A run that ended early is `path`, with the stages before it `paths`."""
    path: Path
    paths: list[Path]

@final
class Fitted:
    """A law fitted to tests: coefficients, misfits, warnings; `rubber(bulk=…)` is the law for a scene, `rubber()` that of a foam."""
    def rubber(self, *, bulk: float | None = None) -> Law:
        """The law for a scene: with k/2 (J - 1)², k being `bulk`, or that of volumetric tests; foams are compressible and take none."""
    def nominal(self, stretches: Sequence[float], mode: str = 'uniaxial') -> _Array:
        """Nominal stresses of the law at stretches in a test."""
    @property
    def bulk(self) -> float | None:
        """The bulk modulus of volumetric tests [stress]; none without them, and of foams, which have it among their coefficients."""
    @property
    def coefficients(self) -> list[tuple[str, float]]:
        """Coefficients by name; those of "ogden" are those of `ogden` with `convention="abaqus"`."""
    @property
    def misfits(self) -> list[tuple[str, float]]:
        """Relative misfits by test."""
    @property
    def warnings(self) -> list[str]:
        """Things to know."""
    def _repr_svg_(self) -> str: ...

class Interrupted(KeyboardInterrupt):
    """A run that Ctrl-C ended. Its steps up to there are `path`, also `Scene.path`, with the stages before it `paths`; before the first one there is none."""
    path: Path | None
    paths: list[Path]

@final
class Law:
    """A law of a rubber or a foam: a stored energy W(F) per reference volume, in the unit of its constants."""
    def energy(self, gradient: ArrayLike) -> float:
        """The stored energy at a deformation gradient, 3 × 3."""
    def stress(self, gradient: ArrayLike) -> _Array:
        """The first Piola–Kirchhoff stress at a deformation gradient, 3 × 3."""
    def nominal(self, stretches: Sequence[float], mode: str = 'uniaxial') -> _Array:
        """Nominal stresses at stretches in a test, "uniaxial", "equibiaxial" or "planar": of rubber, with k/2 (J - 1)², without change of volume, of foams with that of a free surface. "volumetric": mean Cauchy stresses at ratios of the volume."""
    def relaxing(self, pairs: Sequence[tuple[float, float]]) -> Law:
        """The same relaxing: pairs of the part of the stress at first that goes, and its time, `[(0.3, 1.0), …]`. The scene needs `over_time`."""
    @property
    def shear(self) -> float:
        """The shear modulus at rest [stress]."""
    @property
    def bulk(self) -> float:
        """The bulk modulus at rest [stress]."""

@final
class Mesh:
    """A mesh of the plane or of space: particles at its nodes. From a Gmsh file (`Mesh.read`), from arrays, or from an object of meshio or pyvista (`Mesh.of`)."""
    def __new__(cls, points: ArrayLike, cells: Mapping[str, ArrayLike], groups: Mapping[str, Mapping[str, ArrayLike]] | None = None) -> Mesh: ...
    @staticmethod
    def read(file: str | PathLike[str]) -> Mesh:
        """Reads a file of Gmsh, MSH 2.2 or 4.1: names are those of its physical groups."""
    @staticmethod
    def of(mesh: Any) -> Mesh:
        """The mesh of an object of meshio (with its `cell_sets`) or pyvista."""
    def body(self, name: str) -> Mesh:
        """The mesh of a named volume, or area in the plane, alone."""
    @property
    def volume(self) -> float:
        """Its volume [length³], or area in the plane."""
    @property
    def names(self) -> list[str]:
        """The names of its parts."""

@final
class Outline:
    """A closed line of the plane, drawn piece by piece; pieces have names. Draw around the area counter-clockwise."""
    def __new__(cls, start: Sequence[float]) -> Outline: ...
    @staticmethod
    def circle(name: str, centre: Sequence[float], radius: float) -> Outline:
        """A whole circle."""
    def line(self, name: str, to: Sequence[float]) -> Outline:
        """A line to a point."""
    def arc(self, name: str, to: Sequence[float], centre: Sequence[float], *, clockwise: bool = False) -> Outline:
        """An arc about a centre to a point, counter-clockwise, or clockwise."""
    def close(self, name: str) -> Outline:
        """A line back to the start."""

@final
class Path:
    """The states of a run, the one at rest first. Fields are those of one state: of the last one, or of the one that an index picks, `path[3].displacement`. Arrays have a row for each particle, or for each state."""
    def displacement_at(self, points: ArrayLike) -> _Array:
        """Displacements at points of the body at rest [length]."""
    def cauchy_at(self, points: ArrayLike) -> _Array:
        """Cauchy stresses at points of the body at rest [stress], for scenes of one body."""
    def reaction(self, place: _Place) -> _Array:
        """The force on the body by the conditions at a place, or by the condition, rigid body or contact of a name, in this state."""
    def force(self, place: _Place) -> _Array:
        """The same in all states, a row for each."""
    def moment(self, place: _Place, about: Sequence[float]) -> _Array:
        """The moment about a point of the forces by the conditions at a place, in this state: three components."""
    def contact(self, name: str) -> dict[str, Any]:
        """A contact in this state: force on the body, what touches (`extent`: width or area), and by boundary particle `points`, `pressure` and `gap`."""
    def shape_functions(self, points: ArrayLike) -> _Csr:
        """The problem's shape functions at points: `(data, indices, indptr)` of a sparse matrix, points × particles, for `scipy.sparse.csr_matrix`."""
    def write(self, file: str | PathLike[str]) -> None:
        """Writes the path for ParaView, `name.pvd` with a `.vtu` file for each state, and its forces and moments as `name.csv`."""
    def pyvista(self) -> Any:
        """This state as an object of pyvista, which has to be installed."""
    def plot(self, field: str = 'displacement', *, title: str | None = None) -> Picture:
        """A picture of this state, coloured by "displacement", "largest stretch", "von Mises stress" or "mean stress". A notebook shows it."""
    @property
    def gradient(self) -> _Array:
        """Deformation gradients at the particles, means of the points around each, 3 × 3."""
    @property
    def ending(self) -> str:
        """How the run ended: "completed", "stopped", "stalled"."""
    @property
    def doubts(self) -> list[str]:
        """What makes the path doubtful, a sentence for each doubt."""
    @property
    def load(self) -> _Array:
        """Load factors of all states."""
    @property
    def energy(self) -> _Array:
        """Stored energies of all states, of the whole revolution for bodies of revolution."""
    @property
    def unknowns(self) -> int:
        """Displacement unknowns."""
    @property
    def seconds(self) -> float:
        """Seconds from particles to the last state."""
    @property
    def value(self) -> float | None:
        """The value of `of`, where `within` asked for one: extrapolated from a series of models, of which this path is the last."""
    @property
    def bound(self) -> float | None:
        """The bound of the relative error of `value`. Forces and fields are those of the model alone and are not bounded."""
    @property
    def points(self) -> _Array:
        """Particles at rest [length]."""
    @property
    def cauchy(self) -> _Array:
        """Cauchy stresses at the particles [stress], 3 × 3 for each, in equilibrium with the loads for a single body."""
    @property
    def displacement(self) -> _Array:
        """Displacements at the particles [length]."""
    @property
    def iterations(self) -> int:
        """Newton iterations, those of rejected steps included."""
    @property
    def stretch(self) -> _Array:
        """Largest principal stretches at the particles."""
    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> Path: ...
    def __iter__(self) -> Iterator[Path]: ...
    def _repr_svg_(self) -> str: ...

@final
class Picture:
    """A picture that a notebook shows."""
    def save(self, file: str | PathLike[str]) -> None:
        """Writes the picture as SVG, or without title and colour bar to a file that ends with .png."""
    def _repr_svg_(self) -> str: ...

@final
class Place:
    """Where a condition or a load acts, or a result is asked for. Where a function `within` says which part is meant, results are asked for by the same object."""
    def __new__(cls, part: _Part | None = None, *, at: Sequence[float] | None = None, of: str | None = None, within: Callable[[_Array], bool] | None = None) -> Place: ...

@final
class Region:
    """What an outline encloses, without holes. Particles are scattered over it by `spacing` or `particles`."""
    def __new__(cls, outline: Outline, holes: Sequence[Outline] = ...) -> Region: ...
    @property
    def names(self) -> list[str]:
        """The names of its parts."""
    @property
    def area(self) -> float:
        """The area [length²]."""

@final
class Scene:
    """A body with its law, conditions, loads and contacts. Methods give a new scene and leave the old one as it was."""
    def __new__(cls, body: _Body | None = None, law: Law | None = None, kinematics: str | None = None, *, thickness: float | None = None) -> Scene: ...
    def body(self, name: str, geometry: _Body, law: Law, *, particles: int | Sequence[int] | None = None, spacing: float | None = None) -> Scene:
        """Adds a body of a name; `particles` and `spacing` are those of this body alone."""
    def unbonded(self, first: str, second: str) -> Scene:
        """Leaves two bodies unbonded where they touch."""
    def name(self, name: str, place: _Place) -> Scene:
        """Gives a place a name."""
    def hold(self, place: _Place) -> Scene:
        """Holds all displacement components on a part."""
    def move(self, place: _Place, by: _Vector, *, name: str | None = None, over: Sequence[tuple[float, float]] | None = None) -> Scene:
        """Moves a part: a vector [length], or a function of X or of X and the load factor that gives one; arguments with defaults are the function's own. `over` is a table of pairs of load factor and value in place of the ramp; results go by `name`."""
    def prescribe(self, place: _Place, component: int, value: float | Callable[[_Array], float], *, name: str | None = None, over: Sequence[tuple[float, float]] | None = None) -> Scene:
        """Prescribes one component of the displacement on a part: a number [length] or a function of X."""
    def pressure(self, place: _Place, pressure: float | Callable[[_Array], float], *, name: str | None = None, over: Sequence[tuple[float, float]] | None = None) -> Scene:
        """A pressure [stress] that follows a part, positive inwards."""
    def traction(self, place: _Place, traction: _Vector, *, name: str | None = None, over: Sequence[tuple[float, float]] | None = None) -> Scene:
        """A dead traction [stress] per area at rest."""
    def force(self, place: _Place, force: Sequence[float], *, name: str | None = None, over: Sequence[tuple[float, float]] | None = None) -> Scene:
        """A dead force on a rigid body or at a point, or shared out evenly over a part or the body."""
    def moment(self, body: str, moment: Sequence[float]) -> Scene:
        """A moment [force × length] on a rigid body: three components, in the plane the third alone counts."""
    def body_force(self, force: _Vector) -> Scene:
        """A dead force per volume at rest [stress/length]."""
    def foundation(self, place: _Place, stiffness: float, *, normal: bool = False) -> Scene:
        """Springs on a part [stress/length], in all directions or along the normal alone."""
    def rigid(self, name: str, place: _Place) -> Scene:
        """Ties a part to a rigid body of a name, which is then held, moved and loaded by that name."""
    def contact(self, place: _Place, name: str, *, plane: tuple[Sequence[float], Sequence[float]] | None = None, sphere: tuple[Sequence[float], float] | None = None, move_by: Sequence[float] | None = None, push: Sequence[float] | None = None, friction: float = 0.0) -> Scene:
        """Lets a part touch a rigid surface: `plane=(point, normal)` with the rigid side behind it, or `sphere=(centre, radius)` (a shaft in the plane), which moves by a vector, or is pushed by a force; results go by the name."""
    def contact_between(self, first: _Place, second: _Place | None, name: str, *, fit: bool = False) -> Scene:
        """Lets two parts touch each other without friction, or one itself; results go by the name. With `fit` they begin inside each other, and the overlap is resolved along the load."""
    def expansion(self, stretch: float | Callable[[_Array], float]) -> Scene:
        """The stretch of free expansion in all directions: a number or a function of X."""
    def without(self, name: str) -> Scene:
        """The same without the conditions, loads and contacts of a name, for a later stage."""
    def move_on(self, name: str, by: Sequence[float]) -> Scene:
        """The same with the rigid surface of a name moving on by a vector, for a later stage."""
    def over_time(self, duration: float) -> Scene:
        """Takes time while the load factor goes from 0 to 1, for laws that relax."""
    def solve(self, *, particles: int | Sequence[int] | None = None, spacing: float | None = None, order: int | None = None, elements: bool = False, dilation: float | None = None, seed: int | None = None, steps: int | None = None, arc_length: bool = False, within: float | None = None, of: str | tuple[str, Any, int] | None = None, progress: bool | Callable[[float, int], Any] | None = None) -> Path:
        """Solves the scene."""
    def history(self, stages: Mapping[str, Callable[[Scene], Scene]], *, particles: int | Sequence[int] | None = None, spacing: float | None = None, order: int | None = None, elements: bool = False, steps: int | None = None, progress: bool | Callable[[float, int], Any] | None = None) -> list[Path]:
        """Solves the scene, then stages that change it, each from where the one before ended: `{name: function}`, a function takes the scene of the stage before and gives the next one, by `without`, `move_on`, `move`, … . Gives a path for each stage, the first for the scene itself. How: as in `solve`. Where a run ends early, or a stage cannot begin, the exception has the paths of all stages up to there as `paths`."""
    @property
    def path(self) -> Path | None:
        """The path of the last run, however it ended."""

@final
class Shape:
    """A shape of space made of balls, blocks, cylinders and others by `|`, `&` and `-`. `Solid.shape(shape, spacing)` gives its body."""
    @staticmethod
    def sphere(centre: Sequence[float], radius: float) -> Shape:
        """A ball."""
    @staticmethod
    def block(min: Sequence[float], max: Sequence[float]) -> Shape:
        """A block between two corners."""
    @staticmethod
    def cylinder(start: Sequence[float], end: Sequence[float], radius: float) -> Shape:
        """A cylinder between the centres of its ends."""
    @staticmethod
    def cone(start: Sequence[float], end: Sequence[float], first: float, second: float) -> Shape:
        """A cone between the centres of its ends, with a radius at each."""
    @staticmethod
    def torus(centre: Sequence[float], axis: Sequence[float], major: float, minor: float) -> Shape:
        """A ring of circular section."""
    @staticmethod
    def half_space(point: Sequence[float], normal: Sequence[float]) -> Shape:
        """All that is behind a plane."""
    def rotated(self, axis: Sequence[float], angle: float) -> Shape:
        """Turned about an axis through the origin [rad]."""
    def translated(self, by: Sequence[float]) -> Shape:
        """Shifted."""
    def named(self, name: str) -> Shape:
        """Names the surfaces that have no name yet."""
    def __or__(self, other: Shape, /) -> Shape: ...
    def __and__(self, other: Shape, /) -> Shape: ...
    def __sub__(self, other: Shape, /) -> Shape: ...

@final
class Solid:
    """What a closed surface of triangles encloses; a lattice of particles is laid through it."""
    @staticmethod
    def stl(file: str | PathLike[str]) -> Solid:
        """The solid of an STL file."""
    @staticmethod
    def shape(shape: Shape, spacing: float) -> Solid:
        """The solid of a shape, with facets of about the spacing [length]."""
    def name(self, name: str, *, plane: tuple[Sequence[float], Sequence[float]] | None = None, cylinder: tuple[Sequence[float], Sequence[float], float] | None = None, block: tuple[Sequence[float], Sequence[float]] | None = None, nearest: Sequence[float] | None = None) -> Solid:
        """Names facets by one of: `plane=(point, normal)`, `cylinder=(point, axis, radius)`, `block=(min, max)`, `nearest=point` (the smooth patch next to it)."""
    @property
    def volume(self) -> float:
        """The volume [length³]."""
    @property
    def names(self) -> list[str]:
        """The names of its parts."""
    @property
    def bounds(self) -> tuple[list[float], list[float]]:
        """Least and largest coordinates."""

def arruda_boyce(shear: float, locking: float, *, bulk: float) -> Law:
    """The law of Arruda and Boyce with µ and the stretch λₘ at which chains lock."""

def blatz_ko(shear: float, poisson: float = 0.25, fraction: float = 0.0) -> Law:
    """The compressible law of Blatz and Ko with µ, ν and f, for foams."""

def energy(expression: str, *, bulk: float, **constants: float) -> Law:
    """A law by an expression of the reduced invariants `I1` and `I2` and named constants, with + k/2 (J - 1)²: `energy("mu/2*(I1 - 3) + c*(I1 - 3)**2", mu=0.8, c=0.01, bulk=1e3)`. It knows + - * / ** ( ) exp log sqrt; derivatives are exact."""

def extended_tube(crosslinks: float, entanglements: float, beta: float, delta: float, *, bulk: float) -> Law:
    """The extended tube model with G_c, G_e, β and δ."""

def fit(tests: Mapping[str, tuple[Sequence[float], Sequence[float]]] | str | PathLike[str], law: str = 'yeoh', *, terms: int | None = None, starts: int = 40, seed: int = 1, allow_unstable: bool = False) -> Fitted:
    """Fits a law to tests: "yeoh", "mooney-rivlin", "neo-hookean", "ogden", "gent", "arruda-boyce", "extended tube", "foam". Tests are `{"uniaxial": (stretches, nominal stresses), …}`, a CSV text with the columns mode, stretch and nominal_stress, or its file. A law that is unstable inside the range of its own data is refused unless `allow_unstable`. `terms` are those of "ogden" and "foam", 2 unless given."""

def gent(shear: float, limit: float, *, bulk: float) -> Law:
    """Gent's law with shear modulus and limit Jₘ of I₁ - 3."""

def material(stress: Callable[[_Array], Any], *, bulk: float | None = None, energy: Callable[[_Array], float] | None = None) -> Law:
    """A law by a Python function: F, a 3 × 3 array, in; the stress P out, or P with the tangent dP/dF, 3 × 3 × 3 × 3. Without a tangent it is made of differences. With `bulk` the function gives the distortional part alone, and k/2 (J - 1)² is added, which nearly incompressible rubber needs in order not to lock."""

def mooney_rivlin(a10: float, a01: float, *, bulk: float) -> Law:
    """W = A₁₀ (I₁ - 3) + A₀₁ (I₂ - 3) + k/2 (J - 1)²."""

def neo_hookean(a10: float, *, bulk: float) -> Law:
    """W = A₁₀ (I₁ - 3) + k/2 (J - 1)²; A₁₀ is half the shear modulus."""

def ogden(terms: Sequence[tuple[float, float]], *, bulk: float, convention: str | None = None) -> Law:
    """Ogden's law, Σ µ/α (λ₁^α + λ₂^α + λ₃^α - 3) + k/2 (J - 1)², by pairs (µ, α). `convention="abaqus"` takes µ of 2µ/α² (Abaqus, CalculiX, felupe), "febio" c of c/α²."""

def polynomial(terms: Mapping[tuple[int, int], float], *, bulk: float) -> Law:
    """W = Σ Aₘₙ (I₁ - 3)ᵐ (I₂ - 3)ⁿ + k/2 (J - 1)²: `{(1, 0): 0.5, (0, 1): 0.1}`."""

def shape_functions(particles: ArrayLike, points: ArrayLike, support: ArrayLike, *, order: int = 1, boxes: bool = True) -> tuple[_Csr, list[_Csr]]:
    """Reproducing kernel shape functions of particles (n × D) with balls or boxes of radius `support` (one number, or one for each particle) [length], tabulated at points (m × D): `(values, gradients)`, `values` as `(data, indices, indptr)` for `scipy.sparse.csr_matrix(…, shape=(m, n))`, `gradients` a list of such, one for each axis."""

def yeoh(a10: float, a20: float, a30: float, *, bulk: float) -> Law:
    """W = A₁₀ (I₁ - 3) + A₂₀ (I₁ - 3)² + A₃₀ (I₁ - 3)³ + k/2 (J - 1)²."""
