//! Forces and moments by place.

use std::ops::Range;

use crate::assembly::Model;
use crate::boundary::ConstraintEquation;
use crate::each::{Each, IntoEach, list_of};
use crate::error::{BoundaryError, Error, Invalid, SolveError};
use crate::geometry::{Part, Point};
use crate::output::{PvdCollection, Table, check_ending};
use crate::solve::{EquilibriumPath, State};

use super::rigid_motion::rotation_vector;
use crate::scene::discretisation::conditions::Placed;
use crate::scene::discretisation::frame::RigidFrame;
use crate::scene::{DiscreteBody, Place, Problem, Spot, resolve};

/// Sums of coefficients below this part of their sizes are none.
const CANCELS: f64 = 1e-9;

/// A constraint equation by its number, and the nodes whose forces are summed.
struct Reacting<'a> {
    number: usize,
    equation: &'a ConstraintEquation,
    nodes: &'a Range<usize>,
}

impl Reacting<'_> {
    /// Node, component and coefficient of the entries at these nodes.
    fn entries(&self, dim: usize) -> impl Iterator<Item = (usize, usize, f64)> {
        let entries = self.equation.entries.iter().map(move |&(k, c)| (k / dim, k % dim, c));
        entries.filter(|(node, ..)| self.nodes.contains(node))
    }
}

/// A place in a table of forces and displacements.
struct Recorded<'a> {
    title: String,
    rows: Vec<Reacting<'a>>,
    /// The rigid body of that name.
    frame: Option<&'a RigidFrame>,
}

impl Recorded<'_> {
    /// Whether it is the same conditions as another one.
    fn is(&self, other: &Self) -> bool {
        let numbers = |rows: &[Reacting<'_>]| rows.mapped(|row| (row.number, row.nodes.start));
        self.title == other.title && numbers(&self.rows) == numbers(&other.rows)
    }
}

/// Tells conditions of one title apart: parts by functions are written alike.
fn number_titles(places: &mut [Recorded<'_>]) {
    for k in (0..places.len()).rev() {
        let before = places[..k].iter().filter(|other| other.title == places[k].title).count();
        if before > 0 {
            places[k].title += &format!(" ({})", before + 1);
        }
    }
}

/// $-\sum_J \mu_J \sum_k c_{Jk}$ by components.
fn reaction(dim: usize, rows: &[Reacting<'_>], state: &State) -> [f64; 3] {
    let mut force = [0.0; 3];
    for row in rows {
        for (_, component, c) in row.entries(dim) {
            force[component] -= state.multipliers[row.number] * c;
        }
    }
    force
}

/// Each row with what a unit displacement of its nodes in a component prescribes.
fn unit_motion(dim: usize, rows: &[Reacting<'_>], component: usize) -> Vec<(usize, f64)> {
    let sum = |row: &Reacting<'_>| row.entries(dim).filter(|entry| entry.1 == component).map(|entry| entry.2).sum();
    rows.mapped(|row| (row.number, sum(row)))
}

/// The same for a unit turn about the line through a point along an axis, from the current positions; adds what changes the moment of the
/// forces where their points of attack move to `levers`.
fn unit_turn(
    model: &Model,
    rows: &[Reacting<'_>],
    state: &State,
    about: &[f64],
    axis: usize,
    levers: &mut [f64],
) -> Vec<(usize, f64)> {
    let (dim, next, last) = (model.dim(), (axis + 1) % 3, (axis + 2) % 3);
    let mut turns = Vec::with_capacity(rows.len());
    for row in rows {
        let mut turn = 0.0;
        for (node, component, c) in row.entries(dim) {
            // About axis i a turn moves along i + 2 by the arm along i + 1, and along i + 1 against that along i + 2.
            let (along, sign) = match component {
                _ if component == last => (next, 1.0),
                _ if component == next => (last, -1.0),
                _ => continue,
            };
            if along < dim {
                let at = node * dim + along;
                // The coefficients X + d reproduce the current position exactly.
                let arm = model.coordinates(node)[along] + state.displacement[at] - about[along];
                turn += sign * c * arm;
                levers[at] -= sign * state.multipliers[row.number] * c;
            }
        }
        turns.push((row.number, turn));
    }
    turns
}

/// The moment of the forces about a point, about some axes.
fn moment(model: &Model, rows: &[Reacting<'_>], state: &State, about: &[f64], axes: Range<usize>) -> [f64; 3] {
    let (mut moment, mut levers) = ([0.0; 3], vec![0.0; model.unknowns()]);
    for axis in axes {
        for (number, turn) in unit_turn(model, rows, state, about, axis, &mut levers) {
            moment[axis] -= state.multipliers[number] * turn;
        }
    }
    moment
}

/// The mean of a displacement component over equations; none where none of them prescribes it, or where their parts cancel.
fn mean_displacement(dim: usize, rows: &[Reacting<'_>], state: &State, component: usize) -> Option<f64> {
    let (mut total, mut sizes, mut sum) = (0.0, 0.0, 0.0);
    for row in rows {
        for (node, _, c) in row.entries(dim).filter(|entry| entry.1 == component) {
            total += c;
            sizes += c.abs();
            sum += c * state.displacement[node * dim + component];
        }
    }
    // Normals of a closed surface cancel.
    (total.abs() > CANCELS * sizes).then(|| sum / total)
}

/// The table of [`Problem::history`].
fn table(model: &Model, places: &[Recorded<'_>], axes: &Range<usize>, path: &EquilibriumPath) -> Result<Table, Error> {
    let dim = model.dim();
    let mut header: Vec<String> = ["step", "load", "energy"].map(String::from).to_vec();
    let mut moves = Vec::with_capacity(places.len());
    for Recorded { title, rows, frame } in places {
        let mut columns = |what: &str, components: &[usize]| {
            header.extend(components.iter().map(|i| format!("{title}: {what}_{i}")));
        };
        let (all, turns): (Vec<usize>, Vec<usize>) = ((0..dim).collect(), axes.clone().collect());
        columns("force", &all);
        columns("moment", &turns);
        let mut moved = all;
        if frame.is_none() {
            moved.retain(|&i| mean_displacement(dim, rows, &path.start, i).is_some());
        }
        columns("displacement", &moved);
        if frame.is_some() {
            columns("rotation", &turns);
        }
        moves.push(moved);
    }
    let mut table = Table::new(header);
    for (step, state) in path.states().enumerate() {
        let mut line = vec![step as f64, state.load, model.at(state)?.energy()];
        for (Recorded { rows, frame, .. }, moved) in places.iter().zip(&moves) {
            line.extend_from_slice(&reaction(dim, rows, state)[..dim]);
            if !axes.is_empty() {
                line.extend_from_slice(&moment(model, rows, state, &[0.0; 3], axes.clone())[axes.clone()]);
            }
            match frame {
                Some(frame) => {
                    let (displacement, rotation) = frame.motion(&state.displacement);
                    line.extend_from_slice(&displacement.as_slice()[..dim]);
                    line.extend_from_slice(&rotation_vector(&rotation)[axes.clone()]);
                }
                None => line.extend(moved.iter().filter_map(|&i| mean_displacement(dim, rows, state, i))),
            }
        }
        table.push(line)?;
    }
    Ok(table)
}

impl<const D: usize> Problem<D> {
    /// The force \[force\] on the body by the conditions at a place, or by the condition of a name:
    /// $-\sum_J \mu_J \sum_k c_{Jk}$ over their rows, component by component. The whole boundary takes in all parts.
    ///
    /// Rows over boundaries, the default, give each face its own force, with that of the equations that it owns at its edges: those along
    /// directions to which its normal is nearest. With rows at particles and finite elements a
    /// particle where two conditions meet belongs to the one that came first, with its whole force: only the sum over all faces
    /// is exact then, and the share of a corner, of the order of the spacing, may be missing from one of them.
    ///
    /// # Errors
    /// Where no condition acts there, with the names and places of those that there are; for a state of another problem.
    pub fn reaction(&self, state: &State, place: impl Into<Place<D>>) -> Result<Point<D>, Error> {
        Ok(Point::from_column_slice(&reaction(D, &self.rows_at(state, &place.into())?, state)[..D]))
    }

    /// The moment \[force × length\] about a point, in current positions, of the forces by the conditions at a place or by the
    /// condition of a name: three components in space, the third alone in the plane, per unit thickness. Symmetry leaves bodies of
    /// revolution none.
    ///
    /// # Errors
    /// As [`reaction`](Problem::reaction), and for a point that is not finite.
    pub fn moment(&self, state: &State, place: impl Into<Place<D>>, about: [f64; D]) -> Result<[f64; 3], Error> {
        if let Some(&value) = about.iter().find(|x| !x.is_finite()) {
            return Err(Invalid::new("point about which a moment is taken", value, "give finite coordinates").into());
        }
        Ok(moment(&self.model, &self.rows_at(state, &place.into())?, state, &about, self.turns()))
    }

    /// The axes about which forces have moments.
    pub(crate) fn turns(&self) -> Range<usize> {
        let plane = |body: &DiscreteBody<D>| body.body.table().hoop_components().is_empty();
        match D {
            3 => 0..3,
            2 if self.discrete_bodies.iter().all(plane) => 2..3,
            _ => 0..0,
        }
    }

    /// Load factor, energy, and at all places with conditions the reaction, its moment about the origin and the mean
    /// displacement in the directions that are prescribed, step by step: a [`Table`], which writes itself as CSV. Rigid bodies
    /// have the displacement of their middle and their rotation vector \[rad\] instead. Places that are written alike are numbered.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// let pad = Scene::new(Block::new([0.0, 0.0], [4.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?)
    ///     .name("bottom", (1, Side::Min))
    ///     .hold("bottom")
    ///     .with(Condition::on((1, Side::Max)).displacement([0.2, 0.0]).named("push"));
    /// let problem = pad.discretize(&Scheme::default().particles([9, 3]))?;
    /// let path = problem.run()?.completed()?;
    /// let history = problem.history(&path)?;
    /// assert_eq!(history.header[3], "bottom: force_0");
    /// assert_eq!(history.rows.len(), 1 + path.steps.len());
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    ///
    /// # Errors
    /// For a path of another problem.
    pub fn history(&self, path: &EquilibriumPath) -> Result<Table, Error> {
        for state in path.states() {
            self.check_state(state)?;
        }
        let mut places: Vec<Recorded<'_>> = Vec::new();
        for placed in self.placed.iter().filter(|placed| !placed.equations.is_empty()) {
            let title = self.title(placed);
            let rows = match (&placed.name, &placed.place) {
                (Some(name), _) => self.rows(&Place::on(Part::Named(name.clone()))),
                (None, Some(place)) => self.rows(place),
                (None, None) => continue,
            };
            let frame = self.frames.iter().find(|frame| frame.name == title);
            let recorded = Recorded { title, rows, frame };
            if !places.iter().any(|other| other.is(&recorded)) {
                places.push(recorded);
            }
        }
        number_titles(&mut places);
        table(&self.model, &places, &self.turns(), path)
    }

    /// Writes a path for ParaView and for tables: `mount.pvd` with a `.vtu` file for each state beside it, the one at rest
    /// first, and [`history`](Problem::history) as `mount.csv`. Time is that of the scene's clock, else the load factor. Where ranks
    /// share the scene each of them writes its piece of a state, and a `.pvtu` file names the pieces; the first rank writes the
    /// other files.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// let pad = Scene::new(Block::new([0.0, 0.0], [4.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?)
    ///     .hold((1, Side::Min))
    ///     .with(Condition::on((1, Side::Max)).displacement([0.2, 0.0]).named("push"));
    /// let problem = pad.discretize(&Scheme::default().particles([9, 3]))?;
    /// let path = problem.run()?.completed()?;
    /// let directory = std::env::temp_dir().join("rkpm-written");
    /// problem.write(&path, directory.join("pad.pvd"))?;
    /// assert!(directory.join("pad_0001.vtu").exists() && directory.join("pad.csv").exists());
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    ///
    /// # Errors
    /// For a path of another problem, an ending other than `pvd`, and where the file system refuses.
    pub fn write(&self, path: &EquilibriumPath, file: impl AsRef<std::path::Path>) -> Result<(), Error> {
        let file = file.as_ref();
        // What stands behind a dot would be left out of the names of all files: `push_0.5` and `push_0.7` would be one.
        check_ending(file, &["pvd"])?;
        let mut films = PvdCollection::default();
        let since = (!self.model.has_clock()).then_some(0.0);
        self.write_states(path, 0, file, "", since, &mut films)?;
        // All ranks sum forces.
        let history = self.history(path)?;
        if self.writes_for_all() {
            films.write(file.with_extension("pvd"))?;
            history.write(file.with_extension("csv"))?;
        }
        Ok(())
    }

    /// Writes the states of a path from one on, 0 that at rest, beside a file whose name they continue, and adds them to a collection.
    /// Time is that of the clock, or the load factor `since` some time.
    pub(in crate::scene) fn write_states(
        &self,
        path: &EquilibriumPath,
        first: usize,
        file: &std::path::Path,
        suffix: &str,
        since: Option<f64>,
        films: &mut PvdCollection,
    ) -> Result<(), Error> {
        let stem = file.file_stem().map_or_else(|| "path".to_string(), |stem| stem.to_string_lossy().into_owned());
        for (step, state) in path.states().enumerate().skip(first) {
            let grid = self.vtk_grid(state)?;
            let ranks = self.model.ranks();
            let ending = if ranks.is_some() { "pvtu" } else { "vtu" };
            let own = file.with_file_name(format!("{stem}{suffix}_{step:04}.{ending}"));
            match ranks {
                Some(ranks) => grid.write_piece(&own, ranks.rank(), ranks.count())?,
                None => grid.write(&own)?,
            }
            let time = since.map_or_else(|| self.time(state), |since| since + state.load);
            films.push(time, own);
        }
        Ok(())
    }

    /// Whether this process writes what all ranks share.
    pub(in crate::scene) fn writes_for_all(&self) -> bool {
        self.model.ranks().is_none_or(|ranks| ranks.rank() == 0)
    }

    /// What a condition is called: its own name, that of its place, or the place.
    fn title(&self, placed: &Placed<D>) -> String {
        match (&placed.name, &placed.place) {
            (Some(name), _) => name.clone(),
            (None, Some(own)) => {
                let named = self.names.iter().find(|(_, place)| place.takes_in(own) && own.takes_in(place));
                named.map_or_else(|| own.to_string(), |(name, _)| name.clone())
            }
            (None, None) => String::new(),
        }
    }

    /// The conditions of a name, or else those at a place, both where one of them has the name of its place; of one body where the place
    /// is.
    pub(in crate::scene) fn placed_at(&self, requested: &Place<D>) -> Vec<&Placed<D>> {
        let mut place = resolve(&self.names, requested);
        let body = place.of.take();
        let nodes = |name: &String| Some(&self.discrete_bodies.iter().find(|body| body.name == *name)?.nodes);
        // What acts on all bodies has rows on each of them.
        let is_of = |placed: &&Placed<D>| {
            let of = placed.place.as_ref().and_then(|place| place.of.as_ref());
            body.as_ref().is_none_or(|name| of == Some(name) || nodes(name) == Some(&placed.nodes))
        };
        let is_there =
            |placed: &&Placed<D>| placed.place.as_ref().is_some_and(|own| place.takes_in(own)) && is_of(placed);
        let has_name = |placed: &&Placed<D>| match &requested.spot {
            Spot::Part(Part::Named(name)) => placed.name.as_ref() == Some(name) && is_of(placed),
            _ => false,
        };
        let named: Vec<_> = self.placed.iter().filter(has_name).collect();
        if !named.is_empty() && !named.iter().any(is_there) {
            return named;
        }
        self.placed.iter().filter(|placed| has_name(placed) || is_there(placed)).collect()
    }

    /// The rows of a name or at a place.
    fn rows(&self, requested: &Place<D>) -> Vec<Reacting<'_>> {
        let mut rows = Vec::new();
        for Placed { equations, nodes, .. } in self.placed_at(requested) {
            let known =
                |number: usize| Some(Reacting { number, equation: self.equations.equations().get(number)?, nodes });
            rows.extend(equations.clone().filter_map(known));
        }
        rows
    }

    /// Refuses states of other problems.
    fn check_state(&self, state: &State) -> Result<(), SolveError> {
        self.check_length(state)?;
        let (given, needed) = (state.multipliers.len(), self.equations.len());
        ensure!(given == needed, SolveError::OtherModel { what: "multipliers", given, needed });
        Ok(())
    }

    /// The same for a state of this problem.
    fn rows_at(&self, state: &State, requested: &Place<D>) -> Result<Vec<Reacting<'_>>, Error> {
        self.check_state(state)?;
        ensure!(!self.placed_at(requested).is_empty(), self.unknown_condition(requested.to_string()));
        Ok(self.rows(requested))
    }

    /// How the conditions of a name, or at a place, change their values where the place moves rigidly: by a unit of translation along each
    /// axis, then by a unit of rotation about a point in its current positions (in 3D about each axis, in the plane once). Each
    /// change has one entry for each constraint equation of the problem, 0 for all others: it is a
    /// [`Rhs::Prescribed`](crate::solve::Rhs::Prescribed), and less its product with multipliers is the force or moment of the place.
    ///
    /// # Errors
    /// As [`moment`](Problem::moment).
    pub fn rigid_changes(
        &self,
        state: &State,
        place: impl Into<Place<D>>,
        about: [f64; D],
    ) -> Result<Vec<Vec<f64>>, Error> {
        let place = place.into();
        self.moment(state, place.clone(), about)?;
        let rows = self.rows(&place);
        let mut parts: Vec<_> = list_of(D, |component| unit_motion(D, &rows, component));
        for axis in self.turns() {
            parts.push(unit_turn(&self.model, &rows, state, &about, axis, &mut vec![0.0; self.model.unknowns()]));
        }
        let change = |parts: Vec<(usize, f64)>| {
            let mut change = vec![0.0; self.equations.len()];
            parts.into_iter().for_each(|(equation, value)| change[equation] += value);
            change
        };
        Ok(parts.into_mapped(change))
    }

    /// The rows of the conditions of a name or at a place, each with the sum of its entries in a component over the nodes of the
    /// condition: what a unit displacement of the place prescribes.
    pub(crate) fn unit_motion(&self, place: &Place<D>, component: usize) -> Vec<(usize, f64)> {
        unit_motion(D, &self.rows(place), component)
    }

    /// The same for a unit turn about the line through a point along an axis, from the current positions; adds what changes the moment
    /// of the forces where their points of attack move to `levers`.
    pub(crate) fn unit_turn(
        &self,
        state: &State,
        place: &Place<D>,
        about: [f64; D],
        axis: usize,
        levers: &mut [f64],
    ) -> Result<Vec<(usize, f64)>, Error> {
        Ok(unit_turn(&self.model, &self.rows_at(state, place)?, state, &about, axis, levers))
    }

    /// Whether a condition of a name or at a place acts in a component.
    pub(crate) fn acts_in(&self, place: &Place<D>, component: usize) -> bool {
        self.rows(place).iter().any(|row| row.equation.entries.iter().any(|&(k, _)| k % D == component))
    }

    /// The error for a place without conditions, with those that have some.
    pub(crate) fn unknown_condition(&self, requested: String) -> BoundaryError {
        let mut known: Vec<String> = Vec::new();
        for placed in &self.placed {
            let title = self.title(placed);
            if !known.contains(&title) {
                known.push(title);
            }
        }
        BoundaryError::UnknownCondition { requested, known: known.join("; ") }
    }
}
