//! The kinds of garment, and the order in which they can be put on.

use crate::cloth::{Fabric, fabric_named};
use crate::studio::error::StudioError;

/// A kind of garment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum GarmentKind {
    /// A pair, over the ankles.
    Socks,
    /// Skin-tight, waist to ankles.
    Leggings,
    /// Close, no sleeves, deep neck.
    Tanktop,
    /// Short sleeves, round neck.
    Tshirt,
    /// Long sleeves, stand-up collar, below the hips.
    Shirt,
    /// Loose long sleeves, small V at the neck.
    Blouse,
    /// Wool, straight, to the ankles.
    Trousers,
    /// Denim, narrow, to the ankles.
    Jeans,
    /// Wide, to the middle of the thigh.
    Shorts,
    /// Flared, to the knee.
    Skirt,
    /// Short sleeves, close above, flared to the knee.
    Dress,
    /// Knitted, wide, long sleeves.
    Pullover,
    /// No sleeves, open in front.
    Vest,
    /// Open in front, turned-down collar.
    Jacket,
    /// Wool, open in front, to the middle of the thigh, wide collar.
    Coat,
    /// Wool, around the neck.
    Scarf,
    /// Knitted cap.
    Hat,
    /// Skin-tight, from below the waist, without legs.
    Briefs,
    /// Skin-tight, over the breast.
    Bra,
    /// Skin-tight, half a millimetre, waist to toes.
    Tights,
    /// Wide dungarees with a bib.
    Overalls,
    /// Sweatshirt, its hood up.
    Hoodie,
    /// A pair, without separate fingers.
    Mittens,
    /// A pair, leather, to the middle of the shin.
    Boots,
}

/// The parts of the body that a garment covers, one bit each.
const FEET: u8 = 1;
const LOWER: u8 = 2;
const UPPER: u8 = 4;
const NECK: u8 = 8;
const HEAD: u8 = 16;
const HANDS: u8 = 32;

/// A kind: name, segmentation template, description, level (higher is farther out), and the parts that it covers.
struct KindRow(&'static str, &'static str, &'static str, i8, u8);

impl GarmentKind {
    /// All kinds.
    pub const ALL: [Self; 24] = [
        Self::Briefs,
        Self::Bra,
        Self::Socks,
        Self::Tights,
        Self::Leggings,
        Self::Tanktop,
        Self::Tshirt,
        Self::Shirt,
        Self::Blouse,
        Self::Trousers,
        Self::Jeans,
        Self::Shorts,
        Self::Skirt,
        Self::Dress,
        Self::Overalls,
        Self::Pullover,
        Self::Hoodie,
        Self::Vest,
        Self::Jacket,
        Self::Coat,
        Self::Scarf,
        Self::Hat,
        Self::Mittens,
        Self::Boots,
    ];

    fn row(self) -> KindRow {
        match self {
            Self::Socks => KindRow("socks", "socks", "a pair, over the ankles", 0, FEET),
            Self::Leggings => KindRow("leggings", "leggings", "skin-tight, waist to ankles", 0, LOWER),
            Self::Tanktop => KindRow("tanktop", "tanktop", "close, no sleeves, deep neck", 0, UPPER),
            Self::Tshirt => KindRow("tshirt", "tshirt", "short sleeves, round neck", 1, UPPER),
            Self::Shirt => KindRow("shirt", "shirt", "long sleeves, stand-up collar, below the hips", 2, UPPER),
            Self::Blouse => KindRow("blouse", "blouse", "loose long sleeves, small V at the neck", 2, UPPER),
            Self::Trousers => KindRow("trousers", "trousers", "wool, straight, to the ankles", 1, LOWER),
            Self::Jeans => KindRow("jeans", "trousers", "denim, narrow, to the ankles", 1, LOWER),
            Self::Shorts => KindRow("shorts", "shorts", "wide, to the middle of the thigh", 1, LOWER),
            Self::Skirt => KindRow("skirt", "skirt", "flared, to the knee", 2, LOWER),
            Self::Dress => {
                KindRow("dress", "dress", "short sleeves, close above, flared to the knee", 2, UPPER | LOWER)
            }
            Self::Pullover => KindRow("pullover", "pullover", "knitted, wide, long sleeves", 3, UPPER),
            Self::Vest => KindRow("vest", "vest", "no sleeves, open in front", 3, UPPER),
            Self::Jacket => KindRow("jacket", "jacket", "open in front, turned-down collar", 4, UPPER),
            Self::Coat => KindRow(
                "coat",
                "coat",
                "wool, open in front, to the middle of the thigh, wide collar",
                5,
                UPPER | LOWER,
            ),
            Self::Scarf => KindRow("scarf", "scarf", "wool, round the neck", 6, NECK),
            Self::Hat => KindRow("hat", "hat", "knitted cap", 6, HEAD),
            Self::Briefs => KindRow("briefs", "underpants", "skin-tight, from below the waist, no legs", -1, LOWER),
            Self::Bra => KindRow("bra", "bra", "skin-tight, over the breast", -1, UPPER),
            Self::Tights => KindRow("tights", "tights", "skin-tight, thin, waist to toes", 0, LOWER | FEET),
            Self::Overalls => KindRow("overalls", "overalls", "denim, wide, with a bib", 2, UPPER | LOWER),
            Self::Hoodie => KindRow("hoodie", "hoodie", "sweatshirt, its hood up", 3, UPPER | NECK | HEAD),
            Self::Mittens => KindRow("mittens", "gloves", "a pair, without separate fingers", 0, HANDS),
            Self::Boots => KindRow("boots", "boots", "a pair, leather, to the middle of the shin", 4, FEET),
        }
    }

    /// The name in requests and file names.
    pub fn name(self) -> &'static str {
        self.row().0
    }

    /// The segmentation template that fits it.
    pub fn template(self) -> &'static str {
        self.row().1
    }

    /// A short description.
    pub fn about(self) -> &'static str {
        self.row().2
    }

    /// The kind of that name.
    pub fn from_name(name: &str) -> Result<Self, StudioError> {
        let found = Self::ALL.into_iter().find(|kind| kind.name() == name.trim());
        let known = || Self::ALL.iter().map(|kind| kind.name()).collect();
        found.ok_or_else(|| StudioError::UnknownGarment { name: name.trim().into(), known: known() })
    }

    /// The kinds with these names, separated by commas; none for an empty text.
    pub fn list(names: &str) -> Result<Vec<Self>, StudioError> {
        names.split(',').filter(|_| !names.trim().is_empty()).map(Self::from_name).collect()
    }

    /// Whether garments can be put on in this order.
    ///
    /// **Errors** the first that does not fit over those worn already, or is worn already.
    pub fn check_order(kinds: &[Self]) -> Result<(), StudioError> {
        for (k, &kind) in kinds.iter().enumerate() {
            let KindRow(.., level, place) = kind.row();
            for &worn in &kinds[..k] {
                let KindRow(.., outer, there) = worn.row();
                if worn == kind {
                    return Err(StudioError::WornTwice { name: kind.name() });
                }
                // One shirt goes over another, but nobody wears two pairs of trousers, or trousers over a skirt.
                let blocked = level < outer || (level == outer && place & there & LOWER != 0);
                if place & there != 0 && blocked {
                    return Err(StudioError::ImpossibleOrder { outer: worn.name(), inner: kind.name() });
                }
            }
        }
        Ok(())
    }

    /// What it is made of, of `templates/fabrics.toml`.
    pub fn fabric(self) -> Fabric {
        let name = match self {
            Self::Socks | Self::Leggings | Self::Tanktop | Self::Tshirt | Self::Briefs => "jersey",
            Self::Bra | Self::Tights => "swimwear",
            Self::Pullover | Self::Hat | Self::Scarf | Self::Mittens => "knit",
            Self::Hoodie => "fleece",
            Self::Shirt => "cotton",
            Self::Blouse | Self::Dress => "silk",
            Self::Trousers | Self::Skirt | Self::Vest => "wool",
            Self::Jeans | Self::Shorts | Self::Overalls => "denim",
            Self::Jacket | Self::Coat => "coating",
            Self::Boots => "leather",
        };
        fabric_named(name).expect("a test asks for the fabric of every kind")
    }

    /// Whether it follows the skin into hollows.
    pub(super) fn is_tight(self) -> bool {
        matches!(
            self,
            Self::Socks | Self::Leggings | Self::Hat | Self::Briefs | Self::Bra | Self::Tights | Self::Mittens
        )
    }

    /// Whether a waistband holds it, over the layers below.
    pub(super) fn has_waistband(self) -> bool {
        matches!(
            self,
            Self::Briefs | Self::Tights | Self::Leggings | Self::Trousers | Self::Jeans | Self::Shorts | Self::Skirt
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_has_a_fabric() {
        assert!(GarmentKind::ALL.iter().all(|kind| kind.fabric().is_valid()));
    }

    #[test]
    fn what_goes_over_what() {
        let order = |names: &str| GarmentKind::check_order(&GarmentKind::list(names).unwrap());
        for fine in [
            "",
            "tshirt,jeans,coat",
            "jeans,tshirt,coat",
            "shirt,trousers,vest,jacket,scarf,hat",
            "socks,leggings,skirt",
            "bra,briefs,tights,shirt,overalls,hoodie,boots",
            "mittens,coat",
            "coat,mittens",
        ] {
            assert_eq!(order(fine), Ok(()), "{fine}");
        }
        for (wrong, inner) in [
            ("coat,shirt", "shirt"),
            ("jacket,tshirt", "tshirt"),
            ("jeans,leggings", "leggings"),
            ("skirt,trousers", "trousers"),
            ("coat,jeans", "jeans"),
            ("skirt,overalls", "overalls"),
            ("tights,briefs", "briefs"),
        ] {
            assert!(
                matches!(order(wrong), Err(StudioError::ImpossibleOrder { inner: i, .. }) if i == inner),
                "{wrong}"
            );
        }
        assert!(matches!(order("hat,hat"), Err(StudioError::WornTwice { .. })));
        assert!(
            matches!(GarmentKind::list("tshirt,cape"), Err(StudioError::UnknownGarment { name, .. }) if name == "cape")
        );
    }
}
