//! The paper from its published data.

use truedepth::{
    files::Limits,
    recording::discover_nested,
    report::{PaperPictures, paper_page},
    reproduce::{Data, Reproduction, Status, reproduce},
};

use crate::data;

fn paper() -> Option<Reproduction> {
    let path = data("zeiss")?;
    let found = discover_nested(&path, &Limits::default()).expect("lists");
    let data = found.into_iter().map(|f| Data::new(f.open().expect("opens"))).collect();
    Some(reproduce("zeiss", data, &mut |_| ()).expect("reproduces"))
}

#[test]
fn numbers_of_the_published_recordings() {
    let Some(paper) = paper() else { return };
    assert_eq!((paper.data.len(), paper.depth.len(), paper.lens.len()), (5, 2, 3));
    let check = |section: &str, what: &str| {
        let section = paper.sections.iter().find(|s| s.id == section).expect("is there");
        let found = section.checks.iter().find(|check| check.what.starts_with(what));
        found.unwrap_or_else(|| panic!("{what}: {:#?}", section.checks)).clone()
    };
    for (device, px) in
        [("iPhone 11 Pro", 434.61), ("iPad 12.9\" 4gen", 602.38), ("iPad 12.9\" 5gen", 530.04)]
    {
        let own =
            check("focal", &format!("{device}: focal length as the paper calibrates, README"));
        // Half of the iPads' frames are not here, and our corners are others: half a percent.
        assert!((own.ours.unwrap().value / px - 1.0).abs() < 0.005, "{own:?}");
        let factory = check("focal", &format!("{device}: factory focal length, README"));
        assert_eq!(factory.status, Status::Agrees, "{factory:?}");
    }
    // Figure 5: the published Python's numbers today.
    for (device, factory_mm) in [("iPhone 11 Pro", -0.58), ("iPad 12.9\" 5gen", 13.69)] {
        let error = check("depth", &format!("{device}: depth error with factory"));
        assert!((error.ours.unwrap().value - factory_mm).abs() < 0.2, "{error:?}");
    }
    let own = check("depth", "iPad 12.9\" 5gen: depth error with own");
    assert!(own.ours.unwrap().value.abs() < 2.0, "{own:?}");
    // Figure 7, and what the paper missed.
    let states: Vec<&str> =
        paper.lens.iter().map(|lens| lens.straightness.state().name()).collect();
    assert_eq!(states.iter().filter(|state| **state == "distorted").count(), 2, "{states:?}");
    assert_eq!(states.iter().filter(|state| **state == "rectified").count(), 1, "{states:?}");

    let pictures = PaperPictures::read(&paper).expect("draws");
    let page = paper_page(&paper, &pictures);
    for id in ["figure-3", "figure-5", "figure-7", "figure5-a-factory", "figure5-b-own"] {
        assert!(page.contains(&format!("id=\"{id}\"")), "{id}");
    }
    assert_eq!(page.matches("data:image/jpeg").count(), 4);
    // Not within the images, where any three letters may come.
    let words: String = page
        .split("base64,")
        .enumerate()
        .map(|(i, part)| if i == 0 { part } else { part.split_once('"').unwrap().1 })
        .collect();
    assert!(!words.contains("NaN"));
}
