//! What is implausible about a step: the likely cause, the figure that shows it, what to do. Commands are in parentheses after
//! what they do, because the page of `paint` leaves them out.
//!
//! Every limit states the values on both sides of it. They were measured on six synthetic people (seeds 1000 to 1005, 16
//! frames a scan), on the scans of the demo and on the foreign man and woman, as they are and with one thing wrong.

use super::body::BodyPlausibility;
use super::garment::GarmentPlausibility;
use super::posture::Posture;

/// A doubt about a step.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Doubt {
    /// What was found, with its figure and the likely cause.
    pub what: String,
    /// What to do.
    pub remedy: String,
}

impl Doubt {
    fn new(what: String, remedy: impl Into<String>) -> Self {
        Self { what, remedy: remedy.into() }
    }
}

/// Angle between thigh and trunk of a person who does not stand, in radians: at most 15° on good scans, 33° of a leg spread as far as
/// it goes, 60° and more of people who sit or bend forward.
const HIP_BENT_FROM: f64 = 45.0 * std::f64::consts::PI / 180.0;
/// Angle between lower leg and thigh of a person who does not stand, in radians: at most 10° on good scans, 60° and more of people
/// who sit, squat or kneel.
const KNEE_BENT_FROM: f64 = 45.0 * std::f64::consts::PI / 180.0;

impl Posture {
    /// A person who sits, squats, kneels or bends.
    pub fn doubt(&self) -> Option<Doubt> {
        let (hip, knee) = (self.hip_bend.unwrap_or(0.0), self.knee_bend.unwrap_or(0.0));
        let found = match (hip > HIP_BENT_FROM, knee > KNEE_BENT_FROM) {
            (true, true) => format!(
                "a hip is bent by {:.0}° and a knee by {:.0}°: the person seems to sit or squat",
                hip.to_degrees(),
                knee.to_degrees()
            ),
            (true, false) => {
                format!("a hip is bent by {:.0}°: the person seems to sit or to bend forward", hip.to_degrees())
            }
            (false, true) => {
                format!("a knee is bent by {:.0}°: the person seems to kneel or to squat", knee.to_degrees())
            }
            (false, false) => return None,
        };
        Some(Doubt::new(found, "scan the person standing upright in an A-pose, legs straight"))
    }
}

/// The trunk of a standing person is at most this far from the vertical, in radians: 4° on good scans, 92° on a scan whose up
/// axis was given wrongly.
const GREATEST_TILT: f64 = 35.0 * std::f64::consts::PI / 180.0;
/// 95th percentile of the distance between scan and fitted model, in metres, from which clothes are suspected: 4 to 13 mm on
/// bare bodies, 13 to 27 mm on clothed ones.
const CLOTHED_FROM: f64 = 0.0105;
/// Without colours only this distance tells, in metres.
const CLOTHED_WITHOUT_COLORS_FROM: f64 = 0.018;
/// Share of trunk and limbs without the colour of the hands: 0 to 13 % on bare bodies, 97 % and more in jacket or vest, 19 % in
/// a tank top and skin-coloured shorts.
const CLOTHED_SHARE: f64 = 0.18;
/// Area of the largest part that the scan does not show, in m². A hole of 24 cm in diameter has 0.045.
const UNSEEN_FROM: f64 = 0.03;

impl BodyPlausibility {
    /// What is implausible, the gravest first.
    pub fn doubts(&self) -> Vec<Doubt> {
        let mut doubts = self.doubts_of_pose();
        let distance = self.fitted_p95.unwrap_or(0.0);
        let clothed = match self.unlike_hands_share {
            Some(share) if share > CLOTHED_SHARE && distance > CLOTHED_FROM => Some(format!(
                "{:.0} % of trunk and limbs have another colour than the hands, and the surface is up to {:.0} mm from a bare body: the person may be clothed",
                1e2 * share,
                1e3 * distance
            )),
            None if distance > CLOTHED_WITHOUT_COLORS_FROM => Some(format!(
                "the surface is up to {:.0} mm from a bare body: the person may be clothed",
                1e3 * distance
            )),
            _ => None,
        };
        doubts.extend(clothed.map(|what| Doubt::new(what, "scan the person without clothes, or in tight underwear")));
        if let Some((area, part)) = self.largest_unseen.as_ref().filter(|(area, _)| *area > UNSEEN_FROM) {
            doubts.push(Doubt::new(
                format!(
                    "the scan does not show {:.0} cm² at the {part}, where the body comes from the model",
                    1e4 * area
                ),
                "scan again if its shape matters there",
            ));
        }
        doubts
    }

    /// What is implausible about the pose, whether the person is bare or dressed, the gravest first.
    pub fn doubts_of_pose(&self) -> Vec<Doubt> {
        let mut doubts = Vec::new();
        let bent = self.posture.doubt();
        // Bending the hips also tilts the trunk; the up axis is right.
        if let Some(tilt) = self.tilt.filter(|tilt| *tilt > GREATEST_TILT && bent.is_none()) {
            doubts.push(Doubt::new(
                format!(
                    "the person leans {:.0}° from the vertical, so the up axis of the file is probably another",
                    tilt.to_degrees()
                ),
                "scan it again with `--up`, for example `--up +z`, or without the flag",
            ));
        }
        doubts.extend(bent);
        doubts
    }
}

/// Median colour change of a garment that is not there, in spreads: at most 0.3; of garments 2.5 to 11, but 0.3 to 0.6 for two
/// that have the colour of what is below.
const ABSENT_BELOW_CHANGE: f64 = 1.0;
/// Share of the garment that is neither off the surface below nor of another colour: 81 to 99 % where there is none.
const ABSENT_FROM_UNCHANGED: f64 = 0.7;
/// Without colours: median gap to the surface below, in metres, that fit and noise leave where there is no garment; its fabric adds its
/// thickness. Where there is none: 0.1 to 1.7 mm, 1.2 to 2.7 mm at the scalp, where fabrics are 2 mm thick. Of garments at least
/// 2.3 mm (socks over leggings), 2.5 mm (leggings, a vest) and 4.1 mm (hats, a jacket over a pullover), 0.6 to 2 mm thick.
const ABSENT_BELOW_GAP: f64 = 0.00145;
/// Without colours: three quarters of what was cut out are nearer than this to the surface below, in metres; the rest may be another
/// garment that is not listed. At most 6.6 mm below a T-shirt.
const ABSENT_BELOW_P75: f64 = 0.007;
/// A smaller unchanged share is still too much for the right template: at most 21 % on garments, 37 to 67 % where the template
/// was another garment's.
const PARTLY_ABSENT_FROM: f64 = 0.3;
/// Share of the rest of the scan that has another colour than the figure near there: at most 2 % on 38 good scans (six synthetic
/// people, the demo, the foreign man and woman, outfit c), 5 % on the woman's coat; 7 % with socks that are not listed, 50 to 72 %
/// with a shirt, trousers or more.
const REST_RECOLORED_FROM: f64 = 0.1;
/// Share of the scan that is far from the figure: at most 3 % on good scans, 7 to 24 % on scans in the wrong order.
const UNEXPLAINED_FROM: f64 = 0.05;
/// Share of an earlier garment that has another colour where it should be visible: at most 65 % on good scans, where little
/// of it is visible at all; 98 % of a garment that was taken off.
const NOT_WORN_FROM: f64 = 0.8;
/// Without colours: share of it that is outside the scan. A swaying skirt reaches 32 %, a jacket that was taken off 55 %.
const NOT_WORN_OUTSIDE_FROM: f64 = 0.45;
/// Less visible area tells nothing, in m².
const LEAST_WORN_AREA: f64 = 0.02;
/// Median distance of visible skin from the scan, in metres, without hands: 0.7 to 1.0 mm on the same person (the man, the woman,
/// the outfits a to d); of 17 scans of another person 1.7 mm, once, and 2.4 to 9.5 mm.
const ANOTHER_PERSON_FROM: f64 = 0.002;
/// Less visible skin tells nothing of the person, in m²: half a face.
const LEAST_SKIN_AREA: f64 = 0.01;
/// The largest hole left in a garment, in m²: fusion leaves smaller ones.
const HOLE_FROM: f64 = 0.005;
/// Length of a hem relative to that of its smoothed line: at most 1.11 on hems that look smooth, also on a pleated dress and a
/// skirt in folds; 1.21 on the collar and front of the foreign woman's coat, 1.15 to 1.26 on four garments of the synthetic people
/// with crumbled edges.
const RAGGED_FROM: f64 = 1.13;
/// Share of a garment's edge that cannot be seen: at most 13 % on 69 garments of the demo, the man, the woman, outfits a to d and
/// outfits 12 to 23 of the 30 from 1fe750f, 16 % on the demo's skirt in an outfit; 35 % on a scarf in the colour of the pullover
/// below it, labels 0.83.
const UNSEEN_EDGE_FROM: f64 = 0.25;

impl GarmentPlausibility {
    /// What is implausible, the gravest first. `name` is the garment's, `worn` are the names of the garments worn before,
    /// innermost first.
    pub fn doubts(&self, name: &str, worn: &[&str]) -> Vec<Doubt> {
        let absent = self.absent(name);
        let is_absent = absent.is_some();
        let mut doubts: Vec<Doubt> = absent.into_iter().collect();
        doubts.extend(self.worn_before.iter().zip(worn).filter_map(|(seen, worn)| {
            let visible = seen.visible_area > LEAST_WORN_AREA;
            let missing = match seen.recolored_share {
                Some(share) => share > NOT_WORN_FROM,
                None => seen.outside_share > NOT_WORN_OUTSIDE_FROM,
            };
            let share = seen.recolored_share.unwrap_or(seen.outside_share);
            (visible && missing).then(|| {
                Doubt::new(
                    format!("the scan does not show the {worn} on {:.0} % of its visible area", 1e2 * share),
                    "check the order of the scans: each must show all garments of the scans before it",
                )
            })
        }));
        let (far, recolored) = (self.unexplained.0, self.rest_recolored_share.unwrap_or(0.0));
        if far > UNEXPLAINED_FROM || recolored > REST_RECOLORED_FROM {
            let what = match far > UNEXPLAINED_FROM {
                true => format!("{:.0} % of the scan is more than 2 cm from the figure dressed so far", 1e2 * far),
                false => format!(
                    "{:.0} % of the rest of the scan has another colour than the figure dressed so far",
                    1e2 * recolored
                ),
            };
            doubts.push(Doubt::new(
                format!("{what}: it may show a garment that is not listed"),
                format!("check the template of the {name}, and that no scan between was left out"),
            ));
        }
        // Clothes that are not listed move the skin, too, so they are named first.
        doubts.extend(self.another_person());
        if self.largest_hole > HOLE_FROM {
            let remedy = match self.hole_is_by_hand {
                true => "undo the stroke that took the cloth away there, or clear the place",
                false => "scan again without the hole",
            };
            doubts.push(Doubt::new(
                format!("a hole of {:.0} cm² is left in the {name}", 1e4 * self.largest_hole),
                remedy,
            ));
        }
        doubts.extend(self.cut_off_hems.iter().map(|height| {
            Doubt::new(
                format!("a hem of the {name}, {height:.2} m above the floor, is where the scan ends: its cloth may be longer"),
                "scan again so that the hem is seen all around, if the cloth is longer",
            )
        }));
        doubts.extend(self.ragged_hem(name));
        doubts.extend(self.unseen_edge_share.filter(|share| !is_absent && *share > UNSEEN_EDGE_FROM).map(|share| {
            Doubt::new(
                format!(
                    "{:.0} % of the edge of the {name} cannot be seen: what is beside it has the same colour and no step",
                    1e2 * share
                ),
                format!("look at it (`view --sheet sheet.png`), and correct it (`paint {name}`)"),
            )
        }));
        doubts
    }

    /// A hem that follows no smooth line.
    fn ragged_hem(&self, name: &str) -> Option<Doubt> {
        let hem = self.most_ragged_hem.filter(|hem| hem.length_per_smooth_length > RAGGED_FROM)?;
        Some(Doubt::new(
            format!(
                "a hem of the {name} is ragged, most of all {:.2} m above the floor: it is {:.0} % longer than a smooth line",
                hem.height,
                1e2 * (hem.length_per_smooth_length - 1.0)
            ),
            format!("look at it (`view --sheet sheet.png`), and correct it (`paint {name}`)"),
        ))
    }

    /// A garment that is not in the scan, wholly or in part.
    fn absent(&self, name: &str) -> Option<Doubt> {
        let gap = self.gap_median?;
        let remedy = format!("check that this is the scan with the {name} on, and that its template is right");
        match (self.color_change, self.unchanged_share) {
            (Some(change), Some(unchanged)) if change < ABSENT_BELOW_CHANGE && unchanged > ABSENT_FROM_UNCHANGED => {
                let what = format!(
                    "the scan seems to show no {name}: {:.0} % of what was cut out lies on the surface below and has its colour",
                    1e2 * unchanged
                );
                Some(Doubt::new(what, remedy))
            }
            (Some(_), Some(unchanged)) if unchanged > PARTLY_ABSENT_FROM => {
                let what = format!(
                    "{:.0} % of the {name} lies on the surface below and has its colour: its template may cover too much",
                    1e2 * unchanged
                );
                Some(Doubt::new(what, remedy))
            }
            (None, _) if gap < ABSENT_BELOW_GAP + self.thickness && self.gap_p75? < ABSENT_BELOW_P75 => {
                let what = format!(
                    "the scan may show no {name}: what was cut out is {:.1} mm off the surface below, about as much as noise, and the scan has no colours to tell",
                    1e3 * gap.abs()
                );
                Some(Doubt::new(what, remedy))
            }
            _ => None,
        }
    }

    fn another_person(&self) -> Option<Doubt> {
        let tells = |median: &f64| *median > ANOTHER_PERSON_FROM && self.skin_area > LEAST_SKIN_AREA;
        let median = self.skin_median.filter(tells)?;
        Some(Doubt::new(
            format!("visible skin is {:.1} mm from the scan: it may show another person", 1e3 * median),
            "check that all scans show the same person",
        ))
    }
}
