//! Declarations of the parameters of the `Params` structs that do not declare their own yet.

use crate::cut::CutParams;
use crate::parameters::{Allowed, Declared, Parameters, nested};
use crate::rig::{PhysicsParams, RigParams};
use crate::segment::RefineParams;
use crate::stack::{PressParams, StackParams};

const fn of(name: &'static str, allowed: Allowed, about: &'static str) -> Declared {
    Declared { name, allowed, about }
}

impl Parameters for RefineParams {
    fn declared() -> Vec<Declared> {
        vec![
            of(
                "method",
                Allowed::Word(&["transfer", "refine"]),
                "transfer: labels of the nearest body vertices, as in Hu 2017; refine: minimum cut with colour and stand-off",
            ),
            of(
                "distance_per_nat",
                Allowed::LENGTH,
                "Distance from a template's limit that counts one nat against a label",
            ),
            of("distance_per_nat_given", Allowed::LENGTH, "Distance per nat for a limit given by --until or --sleeve"),
            of("greatest_prior", Allowed::Real(0.0, 1000.0), "Greatest weight of the template"),
            of("color", Allowed::Real(0.0, 1000.0), "Weight of colour"),
            of("stand_off", Allowed::Real(0.0, 1000.0), "Weight of the distance from the layer inside"),
            of("boundary", Allowed::Real(0.0, 1000.0), "Cost of a boundary where the scan shows no edge"),
            of("rounds", Allowed::Count(1, 50), "Graph cuts, each with the colours that the previous one found"),
        ]
    }
}

impl Parameters for CutParams {
    fn declared() -> Vec<Declared> {
        vec![
            of("smoothing_radius", Allowed::LENGTH, "Boundary wiggles up to four times this length are smoothed"),
            of("fairing_rounds", Allowed::Count(0, 10_000), "Rounds of fairing along the hem"),
            of("least_island_share", Allowed::SHARE, "Islands with a smaller share of the garment's area are dropped"),
            of("greatest_filled_hole", Allowed::Real(0.0, 1.0), "Holes up to this area, in square metres, are filled"),
        ]
    }
}

impl Parameters for RigParams {
    fn declared() -> Vec<Declared> {
        vec![
            of(
                "method",
                Allowed::Word(&["closest", "inpaint"]),
                "Weights of the closest triangle, or inpainted where the match is not confident",
            ),
            of(
                "distance_per_diagonal",
                Allowed::Real(1e-3, 1.0),
                "Matches farther than this share of the body's diagonal are ignored",
            ),
            of("trusted_angle_deg", Allowed::ANGLE, "Full confidence up to this angle between cloth and skin"),
            of("rejected_angle_deg", Allowed::ANGLE, "No confidence from this angle on"),
            of("smoothing_length", Allowed::LENGTH, "Length over which confident weights are smoothed"),
            of("fairing_width", Allowed::LENGTH, "Wider regions without confident weights are bridged straight"),
        ]
    }
}

impl Parameters for PhysicsParams {
    fn declared() -> Vec<Declared> {
        vec![
            of("greatest_share", Allowed::SHARE, "Largest share of cloth physics in the blend with skinning"),
            of("smoothing_length", Allowed::LENGTH, "Length over which physics weights are smoothed"),
        ]
    }
}

impl Parameters for StackParams {
    fn declared() -> Vec<Declared> {
        vec![
            of(
                "method",
                Allowed::Word(&["paper", "push", "smooth"]),
                "paper: Eq. 7 of Hu 2017 along vertex normals; push: each vertex towards the surface; smooth: one smooth move",
            ),
            of("clearance", Allowed::SHORT, "Distance to keep from the layer inside"),
            of("iterations", Allowed::ROUNDS, "Maximum number of rounds of pushing"),
            of("smoothing_lengths", Allowed::LENGTHS, "Lengths over which a push is spread, one solve per length"),
            of(
                "greatest_depth",
                Allowed::LENGTH,
                "Cloth deeper than this is ignored as a pocket or the other side of a collar",
            ),
        ]
    }
}

impl Parameters for PressParams {
    fn declared() -> Vec<Declared> {
        [
            vec![of(
                "least_cosine",
                Allowed::Real(-1.0, 1.0),
                "Layers whose normals differ by more than this cosine do not press each other",
            )],
            nested::<StackParams>(),
        ]
        .concat()
    }
}
