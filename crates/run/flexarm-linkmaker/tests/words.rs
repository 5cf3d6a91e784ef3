//! Words of a reduction: materials and splits.

use flexarm_fem::Material;
use flexarm_linkmaker::reduce::{MaterialChoice, SplitChoice};

#[test]
fn a_material_is_a_preset_or_three_constants() {
    assert_eq!("steel".parse::<MaterialChoice>().unwrap().material, Material::STEEL);
    let aluminum: MaterialChoice = "aluminum".parse().unwrap();
    assert_eq!((aluminum.name, aluminum.material), (Some("aluminium"), Material::ALUMINIUM));
    let given: MaterialChoice = "70e9, 0.33, 2700".parse().unwrap();
    assert_eq!(given.material, Material::ALUMINIUM);
    for (text, word) in [("steal", "aluminium"), ("70e9,0.33", "E,nu,rho"), ("70e9,0.7,2700", "Poisson")] {
        let message = text.parse::<MaterialChoice>().unwrap_err().to_string();
        assert!(message.contains(word), "{message}");
    }
}

#[test]
fn a_split_has_four_forms() {
    let split = |text: &str| text.parse::<SplitChoice>().unwrap();
    assert_eq!(split("mid"), SplitChoice::Mid);
    assert_eq!(split("0.4"), SplitChoice::Fraction(0.4));
    assert_eq!(split("1,2,3"), SplitChoice::Point([1.0, 2.0, 3.0]));
    for text in ["middle", "1.5", "1,2", "nan"] {
        assert!(text.parse::<SplitChoice>().unwrap_err().to_string().contains("elastic-centre"), "{text}");
    }
}
