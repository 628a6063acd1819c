//! What holds for every picture.

use super::*;

/// Checks that `text` is well-formed XML without a number that is not one.
pub(crate) fn assert_well_formed(text: &str) {
    for bad in ["NaN", "inf", "Infinity"] {
        assert!(!text.contains(&format!("{bad},")) && !text.contains(&format!(",{bad}")), "{bad} in a picture");
        assert!(!text.contains(&format!("\"{bad}\"")), "{bad} in an attribute");
    }
    let mut reader = quick_xml::Reader::from_str(text);
    reader.config_mut().check_end_names = true;
    let mut depth = 0_i64;
    loop {
        match reader.read_event() {
            Ok(quick_xml::events::Event::Eof) => break,
            Ok(quick_xml::events::Event::Start(element)) => {
                depth += 1;
                element.attributes().for_each(|attribute| assert!(attribute.is_ok(), "{attribute:?}"));
            }
            Ok(quick_xml::events::Event::Empty(element)) => {
                element.attributes().for_each(|attribute| assert!(attribute.is_ok(), "{attribute:?}"));
            }
            Ok(quick_xml::events::Event::End(_)) => depth -= 1,
            Ok(_) => {}
            Err(error) => panic!("{error} at {}", reader.buffer_position()),
        }
    }
    assert_eq!(depth, 0);
}

fn figure(marks: Vec<Mark>, log: bool) -> Figure {
    let axis = |label: &str| if log { Axis::new(label, "V").log() } else { Axis::new(label, "V") };
    let panel = Panel { marks, ..Panel::new("(a) <Panel> & \"more\"", axis("x"), axis("y")) };
    Figure::new("test", "A <test>", "").row(Row::one(200.0, panel))
}

fn every_mark(x: &[f64], y: &[f64]) -> Vec<Mark> {
    vec![
        Mark::Band(Band {
            series: "band".to_owned(),
            x: x.to_vec(),
            low: y.iter().map(|y| y - 1.0).collect(),
            high: y.to_vec(),
            colour: Colour::Blue,
            fits: true,
        }),
        Mark::line("line <1>", x, y, Stroke::solid(Colour::Ink, 1.0)),
        Mark::Points(Points {
            series: "points".to_owned(),
            x: x.to_vec(),
            y: y.to_vec(),
            y_error: y.to_vec(),
            titles: vec!["one & two".to_owned()],
            marker: Marker::Cross,
            colour: Colour::Vermillion,
        }),
        Mark::at_x(1.5, "a <rule>"),
        Mark::at_y(2.0, ""),
        Mark::Ellipse(Ellipse {
            series: "ellipse".to_owned(),
            centre: (1.0, 1.0),
            radii: (0.5, f64::NAN),
            angle_rad: 0.3,
            colour: Colour::Green,
            filled: true,
        }),
    ]
}

#[test]
fn pictures_are_well_formed_whatever_the_values() {
    let nasty = [0.0, 1.0, f64::NAN, f64::INFINITY, -2.0, f64::NEG_INFINITY, 1e308, -1e308, 1e-308, 3.0];
    let cases: [(&[f64], &[f64]); 6] = [
        (&[], &[]),
        (&[1.0], &[2.0]),
        (&[1.0, 2.0, 3.0], &[f64::NAN; 3]),
        (&[1.0, 2.0, 3.0], &[5.0, 5.0, 5.0]),
        (&nasty, &nasty),
        (&[1.0, 2.0], &[1.0]),
    ];
    for (x, y) in cases {
        for log in [false, true] {
            let figure = figure(every_mark(x, y), log);
            assert_well_formed(&figure.svg());
            assert_well_formed(&figure.standalone(".line{fill:none}"));
        }
    }
}

#[test]
fn nothing_to_show_is_said() {
    let picture = figure(vec![Mark::line("a", &[], &[], Stroke::solid(Colour::Ink, 1.0))], false).svg();
    assert!(picture.contains("no finite values"));
}

#[test]
fn gaps_start_new_stretches_and_lone_points_show() {
    let y = [1.0, 2.0, f64::NAN, 1.5, f64::NAN, 1.0, 1.2];
    let x: Vec<f64> = (0..7).map(f64::from).collect();
    let picture = figure(vec![Mark::line("a", &x, &y, Stroke::solid(Colour::Ink, 1.0))], false).svg();
    let path = picture.split("class=\"line").nth(2).expect("the curve, after its legend's sample");
    let d = path.split("d=\"").nth(1).and_then(|rest| rest.split('"').next()).expect("a path");
    assert_eq!(d.matches('M').count(), 3, "{d}");
    assert_eq!(d.matches("h0").count(), 1, "{d}");
}

#[test]
fn the_same_figure_gives_the_same_bytes() {
    let x: Vec<f64> = (0..5000).map(|k| f64::from(k) * 1e-3).collect();
    let y: Vec<f64> = x.iter().map(|x| (40.0 * x).sin()).collect();
    assert_eq!(figure(every_mark(&x, &y), false).svg(), figure(every_mark(&x, &y), false).svg());
}

#[test]
fn a_million_points_make_a_small_picture() {
    let x: Vec<f64> = (0..1_000_000).map(f64::from).collect();
    let y: Vec<f64> = x.iter().map(|x| (x * 0.7).sin()).collect();
    let picture = figure(every_mark(&x, &y), false).svg();
    // 1800 columns of at most 4 points of 14 characters, twice for the band, and 2000 markers deduplicated by pixel
    assert!(picture.len() < 6_000_000, "{}", picture.len());
    let line_only = figure(vec![Mark::line("a", &x, &y, Stroke::solid(Colour::Ink, 1.0))], false).svg();
    assert!(line_only.len() < 130_000, "{}", line_only.len());
}
