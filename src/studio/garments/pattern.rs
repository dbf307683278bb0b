//! The sewing pattern of each kind: ease by region, hems, openings. All lengths are in metres.
//!
//! Ease in girth over 2π is the gap between skin and cloth. Chest: T-shirts 10 cm, shirts 10–12, pullovers 14, jackets
//! 15, coats 20. Upper arm: shirts and pullovers 7–8 cm, jackets 9, coats 13. Seat and thigh: jeans 4–8, trousers 6–16.
//! Tight knits have none.

use super::dress_form::DressForm;
use super::flare::Flare;
use super::hem::Hem;
use super::kind::GarmentKind;
use super::size::Grade;
use crate::body::HumanJoint;
use crate::body::HumanJoint::{
    Chest, Foot, Hand, Head, Hips, LowerArm, LowerLeg, Neck, Shoulder, Spine, Toes, UpperArm, UpperChest, UpperLeg,
};
use crate::body::{Limb, Side};
use crate::geometry::{Point, Vec3};
use crate::numerics::Rng;

/// A sewing pattern on a dress form.
pub(super) struct Pattern<'a> {
    pub(super) hems: Vec<Hem<'a>>,
    pub(super) flare: Option<Flare>,
    /// Rest lengths over those of the sewn shape, across and along: the surplus becomes folds.
    pub(super) surplus: [f64; 2],
    /// Connected components of the garment.
    pub(super) pieces: u32,
    /// Width of a turned-down collar, if it has one.
    pub(super) collar: Option<f64>,
}

fn is_trunk(part: HumanJoint) -> bool {
    matches!(part, Hips | Spine | Chest | UpperChest) || is_leg(part)
}
fn is_leg(part: HumanJoint) -> bool {
    matches!(part.limb(), Limb::Leg(_))
}
fn is_arm(part: HumanJoint) -> bool {
    matches!(part.limb(), Limb::Arm(_))
}
fn is_throat(part: HumanJoint) -> bool {
    matches!(part, Neck | Head | Chest | UpperChest | Shoulder(_))
}

impl GarmentKind {
    /// Whether a garment of this kind may cover a part of the body.
    pub(super) fn covers(self, part: HumanJoint) -> bool {
        match self {
            Self::Socks => matches!(part, LowerLeg(_) | Foot(_) | Toes(_)),
            Self::Leggings | Self::Trousers | Self::Jeans | Self::Shorts | Self::Skirt => is_trunk(part),
            Self::Briefs => matches!(part, Hips | Spine | UpperLeg(_)),
            Self::Tights => is_trunk(part),
            Self::Boots => matches!(part, LowerLeg(_) | Foot(_) | Toes(_)),
            Self::Mittens => matches!(part, LowerArm(_) | Hand(_)),
            Self::Overalls => !matches!(part, Head | Hand(_) | LowerArm(_)),
            Self::Hoodie => !matches!(part, LowerLeg(_) | Foot(_) | Toes(_) | Hand(_)),
            Self::Hat => part == Head,
            Self::Scarf => is_throat(part) && part != Chest,
            Self::Dress | Self::Coat => !matches!(part, Head | Hand(_) | Foot(_)),
            _ => !matches!(part, LowerLeg(_) | Foot(_) | Toes(_) | Head | Hand(_)),
        }
    }

    /// Whether it hangs from the hips as one tube around both legs.
    pub(super) fn bridges_legs(self) -> bool {
        matches!(self, Self::Skirt | Self::Dress | Self::Coat)
    }

    /// Gap between skin and sewn cloth.
    pub(super) fn gap(self, part: HumanJoint, along: f64) -> f64 {
        let t = along.clamp(0.0, 1.0);
        let torso = |belly: f64, chest: f64, shoulder: f64| match part {
            Hips | Spine | UpperLeg(_) => belly,
            Chest => chest,
            _ => shoulder,
        };
        let sleeve = |top: f64, elbow: f64, cuff: f64| match part {
            UpperArm(_) => Some(top + (elbow - top) * t),
            LowerArm(_) | Hand(_) => Some(elbow + (cuff - elbow) * t),
            _ => None,
        };
        let leg = |seat: f64, knee: f64, ankle: f64| match part {
            UpperLeg(_) => seat + (knee - seat) * t,
            LowerLeg(_) => knee + (ankle - knee) * t,
            Foot(_) | Toes(_) => ankle,
            _ => seat.min(0.007),
        };
        match self {
            Self::Socks => 0.0025,
            Self::Leggings => leg(0.003, 0.003, 0.003),
            Self::Tanktop => torso(0.007, 0.007, 0.006),
            Self::Tshirt => sleeve(0.012, 0.022, 0.022).unwrap_or_else(|| torso(0.018, 0.015, 0.008)),
            Self::Shirt => sleeve(0.011, 0.016, 0.009).unwrap_or_else(|| torso(0.019, 0.017, 0.009)),
            Self::Blouse => sleeve(0.012, 0.022, 0.012).unwrap_or_else(|| torso(0.022, 0.018, 0.008)),
            Self::Pullover => sleeve(0.013, 0.016, 0.008).unwrap_or_else(|| torso(0.023, 0.022, 0.012)),
            Self::Vest => torso(0.020, 0.020, 0.013),
            Self::Jacket => sleeve(0.014, 0.016, 0.014).unwrap_or_else(|| torso(0.027, 0.025, 0.016)),
            Self::Coat => sleeve(0.020, 0.022, 0.020).unwrap_or_else(|| torso(0.036, 0.034, 0.021)),
            Self::Dress => sleeve(0.012, 0.020, 0.020).unwrap_or_else(|| torso(0.010, 0.012, 0.007)),
            Self::Trousers => leg(0.010, 0.026, 0.032),
            Self::Jeans => leg(0.008, 0.013, 0.017),
            Self::Shorts => leg(0.012, 0.040, 0.040),
            Self::Skirt => 0.006,
            Self::Scarf => 0.020,
            Self::Hat => 0.004,
            Self::Briefs | Self::Bra => 0.002,
            Self::Tights => 0.001,
            Self::Overalls => {
                if is_leg(part) {
                    leg(0.014, 0.030, 0.030)
                } else {
                    torso(0.026, 0.020, 0.010)
                }
            }
            Self::Hoodie => match part {
                Head => 0.018,
                _ => sleeve(0.014, 0.018, 0.010).unwrap_or_else(|| torso(0.024, 0.023, 0.013)),
            },
            Self::Mittens => 0.012,
            Self::Boots => match part {
                LowerLeg(_) => 0.024 - 0.006 * t,
                // Stiff leather touches the foot nowhere but at the sole.
                _ => 0.012,
            },
        }
    }

    /// The pattern of this kind on a dress form, in a size.
    pub(super) fn pattern<'a>(self, form: &'a DressForm, rng: &mut Rng, grade: Grade) -> Pattern<'a> {
        let (hip, knee) = (form.joint(UpperLeg(Side::Left)).y, form.joint(LowerLeg(Side::Left)).y);
        let waist = form.joint(Spine).y;
        // Garments of one kind differ in length.
        let longer = rng.between(-0.02, 0.02) - grade.trunk_length();
        let (leg, sleeve, wider) = (grade.leg_length(), grade.sleeve_length(), grade.gap(Hips));
        let mut pattern = Pattern { hems: Vec::new(), flare: None, surplus: [1.02, 1.02], pieces: 1, collar: None };
        let hems = &mut pattern.hems;
        match self {
            Self::Socks => {
                (pattern.surplus, pattern.pieces) = ([0.96, 1.02], 2);
                hems.extend(Side::BOTH.map(|side| leg_end(form, side, 0.75, -1.0, 0.0)));
            }
            Self::Briefs => {
                pattern.surplus = [0.96, 1.0];
                let top = hip + 0.6 * (waist - hip);
                hems.push(hem(|_| true, move |p| top - p.y));
                hems.extend(Side::BOTH.map(|side| leg_hole(side, hip + 0.28 * (knee - hip), 0.02, 0.8)));
            }
            Self::Bra => {
                pattern.surplus = [0.97, 1.0];
                hems.push(level(hip + 0.53 * (form.joint(Neck).y - hip), 1.0));
                hems.push(round_neck(form, 0.105, 0.085));
                hems.extend(Side::BOTH.map(|side| armhole(form, side, 0.025)));
            }
            Self::Tights => {
                pattern.surplus = [0.96, 1.0];
                hems.push(level(waist - 0.005, -1.0));
            }
            Self::Overalls => {
                // Straps are as wide as the usual buckles of overalls, 38 mm.
                let half = form.joint(UpperArm(Side::Left)).x.abs() - 0.045;
                hems.push(round_neck(form, half - 0.038, 0.085));
                hems.push(bib(form, half));
                hems.extend(Side::BOTH.map(|side| leg_end(form, side, 0.82, 1.0, leg)));
            }
            Self::Hoodie => {
                pattern.surplus = [1.03, 1.04];
                hems.push(level(hip + 0.02 + longer, 1.0));
                hems.push(face(form));
                hems.extend(Side::BOTH.map(|side| sleeve_end(form, side, LowerArm, Hand, 0.95, sleeve)));
            }
            Self::Mittens => {
                (pattern.surplus, pattern.pieces) = ([1.0, 1.0], 2);
                hems.push(hem(|part| !is_arm(part), |_| -1.0));
                hems.extend(Side::BOTH.map(|side| wrist(form, side)));
            }
            Self::Boots => {
                (pattern.surplus, pattern.pieces) = ([1.0, 1.0], 2);
                hems.extend(Side::BOTH.map(|side| leg_end(form, side, 0.45, -1.0, 0.0)));
            }
            Self::Leggings | Self::Trousers | Self::Jeans => {
                let end = if self == Self::Leggings { 0.9 } else { 0.96 };
                pattern.surplus = match self {
                    Self::Leggings => [0.94, 1.0],
                    Self::Jeans => [1.01, 1.03],
                    _ => [1.02, 1.02],
                };
                hems.push(level(waist - 0.005, -1.0));
                hems.extend(Side::BOTH.map(|side| leg_end(form, side, end, 1.0, leg)));
            }
            Self::Shorts => {
                hems.push(level(waist - 0.005, -1.0));
                hems.extend(Side::BOTH.map(|side| thigh_end(form, side, 0.6, leg)));
            }
            Self::Skirt => {
                pattern.surplus = [1.0, 1.0];
                let bottom = knee + 0.05 + longer;
                pattern.flare = Some(Flare { top: waist + 0.01, bottom, gap: 0.006 + wider, widening: 0.27 });
                hems.push(level(waist + 0.01, -1.0));
                hems.push(level(bottom, 1.0));
            }
            Self::Dress => {
                pattern.surplus = [1.01, 1.01];
                let bottom = knee + 0.03 + longer;
                pattern.flare = Some(Flare { top: waist + 0.03, bottom, gap: 0.010 + wider, widening: 0.30 });
                hems.push(level(bottom, 1.0));
                hems.push(round_neck(form, 0.098, 0.045));
                hems.extend(Side::BOTH.map(|side| sleeve_end(form, side, UpperArm, LowerArm, 0.42, sleeve)));
            }
            Self::Tanktop => {
                pattern.surplus = [0.99, 1.01];
                hems.push(level(hip + 0.03 + longer, 1.0));
                hems.push(round_neck(form, 0.105, 0.07));
                hems.extend(Side::BOTH.map(|side| armhole(form, side, 0.012)));
            }
            Self::Tshirt => {
                hems.push(level(hip - 0.01 + longer, 1.0));
                hems.push(round_neck(form, 0.085, 0.028));
                hems.extend(Side::BOTH.map(|side| sleeve_end(form, side, UpperArm, LowerArm, 0.6, sleeve)));
            }
            Self::Shirt | Self::Blouse | Self::Pullover => {
                pattern.surplus = if self == Self::Pullover { [1.03, 1.05] } else { [1.03, 1.03] };
                let below = if self == Self::Shirt { -0.06 } else { 0.02 };
                hems.push(level(hip + below + longer, 1.0));
                match self {
                    Self::Shirt => hems.push(stand_up_neck(form, 0.035)),
                    Self::Blouse => hems.extend([round_neck(form, 0.082, 0.02), v_neck(form, 0.12, 0.35)]),
                    _ => hems.push(round_neck(form, 0.084, 0.02)),
                }
                hems.extend(Side::BOTH.map(|side| sleeve_end(form, side, LowerArm, Hand, 0.95, sleeve)));
            }
            Self::Vest => {
                hems.push(level(hip + 0.03 + longer, 1.0));
                hems.push(round_neck(form, 0.074, 0.01));
                hems.push(open_front(form, 0.008, 0.08));
                hems.extend(Side::BOTH.map(|side| armhole(form, side, 0.022)));
            }
            Self::Jacket => {
                pattern.surplus = [1.02, 1.03];
                pattern.collar = Some(0.055);
                hems.push(level(hip - 0.03 + longer, 1.0));
                hems.push(round_neck(form, 0.070, 0.005));
                hems.push(open_front(form, 0.010, 0.10));
                hems.extend(Side::BOTH.map(|side| sleeve_end(form, side, LowerArm, Hand, 0.98, sleeve)));
            }
            Self::Coat => {
                pattern.surplus = [1.02, 1.02];
                let bottom = hip + 0.5 * (knee - hip) + longer;
                pattern.flare = Some(Flare { top: waist, bottom, gap: 0.042 + wider, widening: 0.12 });
                pattern.collar = Some(0.075);
                hems.push(level(bottom, 1.0));
                hems.push(round_neck(form, 0.074, 0.005));
                hems.push(open_front(form, 0.012, 0.10));
                hems.extend(Side::BOTH.map(|side| sleeve_end(form, side, LowerArm, Hand, 1.0, sleeve)));
            }
            Self::Scarf => {
                pattern.surplus = [1.04, 1.2];
                let (low, high) = (form.joint(Neck).y - 0.025, form.between(Neck, Head, 0.75).y);
                hems.push(slanted(low, 0.30, form.joint(Neck).z, 1.0));
                hems.push(slanted(high, 0.10, form.joint(Neck).z, -1.0));
            }
            Self::Hat => {
                pattern.surplus = [1.0, 1.03];
                let head = form.joint(Head);
                let top = form.body.bounds().map_or(head.y + 0.2, |b| b.max.y);
                hems.push(slanted(head.y + 0.5 * (top - head.y), 0.12, head.z, 1.0));
            }
        }
        pattern
    }
}

fn hem<'a>(concerns: impl Fn(HumanJoint) -> bool + 'a, height: impl Fn(&Point) -> f64 + 'a) -> Hem<'a> {
    Hem { concerns: Box::new(concerns), height: Box::new(height) }
}

/// A horizontal hem at `y` on trunk and legs; with `up` 1 the cloth above it stays, with −1 the cloth below.
fn level<'a>(y: f64, up: f64) -> Hem<'a> {
    hem(is_trunk, move |p| (p.y - y) * up)
}

/// A hem on all parts that rises toward the back (`rise` metres per metre) from `y` at depth `z`.
fn slanted<'a>(y: f64, rise: f64, z: f64, up: f64) -> Hem<'a> {
    hem(|_| true, move |p| (p.y - y + rise * (p.z - z)) * up)
}

/// The end of a sleeve, across the arm.
fn sleeve_end<'a>(
    form: &DressForm,
    side: Side,
    from: fn(Side) -> HumanJoint,
    to: fn(Side) -> HumanJoint,
    along: f64,
    longer: f64,
) -> Hem<'a> {
    let (from, to) = (from(side), to(side));
    let normal = (form.joint(from) - form.joint(to)).normalize();
    let point = form.between(from, to, along) - normal * longer;
    hem(move |part| part.limb() == Limb::Arm(side), move |p| (p - point).dot(&normal))
}

/// The end of a trouser leg, across the shin; with `up` −1 the cloth at the foot stays.
fn leg_end<'a>(form: &DressForm, side: Side, along: f64, up: f64, longer: f64) -> Hem<'a> {
    let (from, to) = (LowerLeg(side), Foot(side));
    let normal = (form.joint(from) - form.joint(to)).normalize();
    let point = form.between(from, to, along) - normal * longer;
    hem(move |part| part.limb() == Limb::Leg(side) && part != UpperLeg(side), move |p| (p - point).dot(&normal) * up)
}

/// The end of a short trouser leg, across the thigh.
fn thigh_end<'a>(form: &DressForm, side: Side, along: f64, longer: f64) -> Hem<'a> {
    let (from, to) = (UpperLeg(side), LowerLeg(side));
    let normal = (form.joint(from) - form.joint(to)).normalize();
    let point = form.between(from, to, along) - normal * longer;
    hem(move |part| part.limb() == Limb::Leg(side), move |p| (p - point).dot(&normal))
}

/// A leg hole, from `inner` metres beside the middle at the height of the `crotch` outward and up, `slope` metres per metre.
fn leg_hole<'a>(side: Side, crotch: f64, inner: f64, slope: f64) -> Hem<'a> {
    hem(
        |_| true,
        move |p| {
            let out = p.x * side.sign() - inner;
            if p.x * side.sign() > 0.0 { p.y - crotch - slope * out } else { 1.0 }
        },
    )
}

/// The end of a mitten, across the forearm.
fn wrist<'a>(form: &DressForm, side: Side) -> Hem<'a> {
    let (from, to) = (LowerArm(side), Hand(side));
    let normal = (form.joint(to) - form.joint(from)).normalize();
    let point = form.between(from, to, 0.85);
    hem(move |part| part.limb() == Limb::Arm(side), move |p| (p - point).dot(&normal))
}

/// The opening of a hood: of the head, what is in front of the temples and above the chin is free.
fn face<'a>(form: &DressForm) -> Hem<'a> {
    let (head, chin) = (form.joint(Head), form.between(Neck, Head, 0.8).y);
    let front = head.z + 0.045;
    hem(is_throat, move |p| (front - p.z - 0.15 * (p.y - head.y)).max(chin - p.y))
}

/// An armhole, around the root of the arm, `inward` metres toward the neck from the joint.
fn armhole<'a>(form: &DressForm, side: Side, inward: f64) -> Hem<'a> {
    let toward_neck = -side.sign();
    let shoulder = form.joint(UpperArm(side)) + Vec3::new(toward_neck * inward, 0.0, 0.0);
    // Farther out below, where the chest is wider than the shoulder.
    let normal = Vec3::new(toward_neck, -0.1, 0.0).normalize();
    let own = move |p: &Point| p.x * toward_neck < 0.0;
    hem(|part| is_arm(part) || is_throat(part), move |p| if own(p) { (p - shoulder).dot(&normal) } else { 1.0 })
}

/// The side edges of a bib of twice the width `half`, in front and behind: straight down, then level around the sides above the waist.
fn bib<'a>(form: &DressForm, half: f64) -> Hem<'a> {
    let side = form.between(Spine, Neck, 0.3).y;
    hem(
        |_| true,
        move |p| {
            /// Metres over which the corner below the arm is rounded.
            const ROUNDING: f64 = 0.04;
            smooth_max(half - p.x.abs(), side - p.y, ROUNDING)
        },
    )
}

/// The greater of two heights, with their corner rounded over `rounding` metres.
fn smooth_max(a: f64, b: f64, rounding: f64) -> f64 {
    0.5 * (a + b + (a - b).hypot(rounding))
}

/// A neckline from the back of the neck to `drop` below the notch of the collar bones, at most `radius` from the neck.
fn round_neck<'a>(form: &DressForm, radius: f64, drop: f64) -> Hem<'a> {
    let point = form.joint(Neck) - Vec3::new(0.0, drop, 0.0);
    let normal = Vec3::new(0.0, -1.0, -0.6).normalize();
    let top = form.joint(Neck).y + 0.015;
    hem(is_throat, move |p| {
        /// Metres over which the two curves of the neckline blend.
        const ROUNDING: f64 = 0.02;
        // In front the chest may be farther from the neck than that: there only the slanted plane counts.
        let across = (p.x - point.x).hypot((p.z - point.z).min(0.0)) - radius;
        let above = (p - point).dot(&normal);
        let stays = smooth_max(across, above, ROUNDING);
        // A thick neck fills the curve: there the hem goes around it.
        stays.min(top - p.y)
    })
}

/// A stand-up collar of this height, lower in front.
fn stand_up_neck<'a>(form: &DressForm, height: f64) -> Hem<'a> {
    let point = form.joint(Neck) + Vec3::new(0.0, height, 0.0);
    let normal = Vec3::new(0.0, -1.0, -0.45).normalize();
    hem(is_throat, move |p| (p - point).dot(&normal))
}

/// A V in front to `depth` below the neck; its half width grows by `slope` metres per metre of height.
fn v_neck<'a>(form: &DressForm, depth: f64, slope: f64) -> Hem<'a> {
    let (neck, chest) = (form.joint(Neck), form.joint(Chest));
    hem(is_throat, move |p| if p.z > chest.z { p.x.abs() - slope * (p.y - (neck.y - depth)) } else { 1.0 })
}

/// An open front: `half` is half its width at the height of the chest, above it is a V of lapels, and below it the width
/// grows by `spread` metres per metre.
fn open_front<'a>(form: &DressForm, half: f64, spread: f64) -> Hem<'a> {
    let (chest, hip) = (form.joint(UpperChest), form.joint(Hips));
    let is_front = move |p: &Point| p.z > chest.z.min(hip.z) + 0.02;
    hem(
        |part| is_trunk(part) || is_throat(part),
        move |p| {
            let wider = if p.y > chest.y { 0.16 * (p.y - chest.y) } else { spread * (chest.y - p.y) };
            if is_front(p) { p.x.abs() - half - wider } else { 1.0 }
        },
    )
}
