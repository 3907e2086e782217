//! Why a converged state may be no answer.

use std::fmt;

/// A reason to doubt a converged state: what was found, where, and at which load.
///
/// Its text, by `Display`, also says what to do.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Doubt {
    /// What was found.
    pub cause: DoubtCause,
    /// Load factor of the state.
    pub load: f64,
    /// Where in the undeformed body \[length\]; empty where it concerns the whole body.
    pub at: Vec<f64>,
}

/// What makes a converged state doubtful, with the numbers behind it.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum DoubtCause {
    /// The field folds: $J$ is not what pressure over bulk modulus allows where a part of the energy is stored.
    Volume {
        /// That part of the elastic energy: the energy in changes of volume over its sum with the distortional one.
        share: f64,
        /// The largest part that counts as an error of the discretisation.
        limit: f64,
        /// $J$ where it is furthest from what the pressure allows.
        jacobian: f64,
        /// What the pressure allows there.
        allowed: f64,
    },
    /// The state is unstable under its loads.
    Unstable {
        /// Unstable modes: negative pivots less constraints.
        modes: usize,
    },
    /// The solver does not count pivots, so that unstable modes are not known.
    StabilityUnknown,
    /// A motion without a unique position is restrained by a spring that should take no force.
    Restrained {
        /// The body.
        body: String,
        /// Moment of the spring \[force·length\].
        moment: f64,
        /// Sum of the contact forces on the body times its radius \[force·length\].
        scale: f64,
    },
    /// The body lies deeper in a rigid surface than its trace functions explain.
    Depth {
        /// The contact.
        contact: String,
        /// How deep \[length\].
        depth: f64,
        /// The largest depth that counts as an error of the discretisation \[length\].
        limit: f64,
        /// Whether the surface is moved into particles whose displacement is prescribed.
        fixed: bool,
    },
    /// The boundary particles do not resolve a contact: the tip of the rigid surface lies between them, or it touches few of them.
    Overlap {
        /// The contact.
        contact: String,
        /// The energy to press out what overlaps, over its sum with the energy of the state.
        share: f64,
        /// The largest share that counts as an error of the discretisation.
        limit: f64,
    },
    /// A body has passed through another one, through itself or through a rigid surface, and no contact was declared.
    Passed {
        /// The body.
        body: String,
        /// The rigid surface, none where it is a body.
        through: Option<String>,
        /// How deep, for bodies how deep at least \[length\].
        depth: f64,
    },
    /// Conditions prescribe different values at a common edge; those of one hold.
    Overruled {
        /// Which conditions and values, and what to do.
        conditions: String,
    },
    /// A body has walls with few particle spacings across.
    ThinWall {
        /// The thinnest one, and what to do.
        wall: String,
    },
    /// A free surface is compressed beyond Biot's limit over two neighbouring trace functions.
    Surface {
        /// The smallest stretch of the surface there.
        stretch: f64,
    },
}

impl Doubt {
    /// Whether the state is no answer; otherwise it may be one, and the doubt says what to look at.
    pub fn refutes(&self) -> bool {
        match self.cause {
            DoubtCause::Volume { .. }
            | DoubtCause::Unstable { .. }
            | DoubtCause::Restrained { .. }
            | DoubtCause::Depth { .. } => true,
            // More is lacking than there is.
            DoubtCause::Overlap { share, .. } => share > 0.5,
            _ => false,
        }
    }
}

impl DoubtCause {
    /// Whether another one is of the same kind, about the same part.
    pub(crate) fn is_like(&self, other: &DoubtCause) -> bool {
        match (self, other) {
            (DoubtCause::Depth { contact, .. }, DoubtCause::Depth { contact: same, .. }) => contact == same,
            (DoubtCause::Overlap { contact, .. }, DoubtCause::Overlap { contact: same, .. }) => contact == same,
            (DoubtCause::Restrained { body, .. }, DoubtCause::Restrained { body: same, .. }) => body == same,
            _ => std::mem::discriminant(self) == std::mem::discriminant(other),
        }
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "at load factor {:.4}", self.load)?;
        if !self.at.is_empty() {
            write!(f, ", near X = (")?;
            for (k, x) in self.at.iter().enumerate() {
                write!(f, "{}{x:.4}", if k > 0 { ", " } else { "" })?;
            }
            write!(f, ")")?;
        }
        write!(f, ": {}", self.cause)
    }
}

impl fmt::Display for DoubtCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            DoubtCause::Volume { share, limit, jacobian, allowed } => write!(
                f,
                "the field folds between particles: {:.1} % of the elastic energy (at most {:.1} %) is stored where the volume is not \
                 what the pressure allows (J = {jacobian:.3} where it allows {allowed:.3}); take more particles there, round the edge \
                 where the rubber creases, or apply less of the load",
                100.0 * share,
                100.0 * limit
            ),
            DoubtCause::Unstable { modes } => write!(
                f,
                "the state is unstable, with {modes} unstable modes: the part buckles, snaps or creases before it gets there; follow the \
                 path by Following::Path or StepControl::ArcLength, give an imperfection or a support, or check the sign of stiffnesses"
            ),
            DoubtCause::StabilityUnknown => write!(
                f,
                "whether the state is stable is not known, because the iterative solver counts no pivots; run a coarser model with \
                 SolverChoice::Direct to find out"
            ),
            DoubtCause::Restrained { body, moment, scale } => write!(
                f,
                "{body} could roll and is restrained by a moment of {moment:.3e}, {:.1} % of the contact forces times its radius: the \
                 motion is not neutral; prescribe it by a condition, or give a surface friction",
                100.0 * moment.abs() / scale
            ),
            DoubtCause::Depth { contact, depth, fixed: true, .. } => write!(
                f,
                "the body lies {depth:.3e} deep in {contact}, which is moved into particles whose displacement is prescribed: move or shorten \
                 the surface, or end the prescribed part before it"
            ),
            DoubtCause::Depth { contact, depth, limit, fixed: false } => write!(
                f,
                "the body lies {depth:.3e} deep in {contact}, more than the {limit:.3e} that its boundary particles resolve: the surface \
                 passes between them; take more particles there, smaller steps, or round the edge of the surface"
            ),
            DoubtCause::Overlap { contact, share, limit } => write!(
                f,
                "{contact} touches too few boundary particles to be resolved: removing the overlap would take {:.1} % of the energy (at most {:.1} %), and \
                 energy and force of the contact may be too small by {:.0} % or more; take more particles there",
                100.0 * share,
                100.0 * limit,
                100.0 * share.sqrt()
            ),
            DoubtCause::Passed { body, through: None, depth } => write!(
                f,
                "{body} overlaps itself or another body by {depth:.3e} or more, where no contact is declared: declare it \
                 (Scene::contact_between, ContactPair::itself), or let the load end before the parts meet"
            ),
            DoubtCause::Passed { body, through: Some(surface), depth } => write!(
                f,
                "{body} lies {depth:.3e} behind {surface} with a part that no contact with it is declared for: declare it \
                 (Scene::contact), or let the load end before the part meets the surface"
            ),
            DoubtCause::Overruled { conditions: what } | DoubtCause::ThinWall { wall: what } => f.write_str(what),
            DoubtCause::Surface { stretch } => write!(
                f,
                "the free surface is compressed to a stretch of {stretch:.3}, beyond Biot's limit: a smooth surface is unstable there and \
                 creases; take the answer up to the load at which this begins, or give the surface a larger radius"
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_say_where_and_what_to_do() {
        let cause = DoubtCause::Depth { contact: "shaft".into(), depth: 0.2, limit: 0.03, fixed: false };
        let text = Doubt { cause, load: 0.5, at: vec![1.0, 0.25] }.to_string();
        assert!(text.starts_with("at load factor 0.5000, near X = (1.0000, 0.2500): "), "{text}");
        assert!(text.contains("2.000e-1 deep in shaft") && text.contains("more particles"), "{text}");
        let whole = Doubt { cause: DoubtCause::Unstable { modes: 3 }, load: 1.0, at: Vec::new() };
        assert!(whole.refutes() && whole.to_string().contains("3 unstable modes"));
        assert!(!Doubt { cause: DoubtCause::StabilityUnknown, ..whole }.refutes());
    }
}
