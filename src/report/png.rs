//! Figures as pictures of pixels, for programs that take no SVG.

use std::sync::Arc;

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree};

/// Pixels for each unit of a figure: 2000 across, 300 to the inch in a picture of 17 cm, a page's width.
const SCALE: f32 = 2.0;

/// What draws them: the same bytes on every machine, since it brings its own letters.
pub(crate) struct Painter {
    options: Options<'static>,
}

impl Painter {
    /// With DejaVu Sans, regular and bold.
    pub(crate) fn new() -> Self {
        let mut options = Options { font_family: FAMILY.to_owned(), ..Options::default() };
        let fonts = Arc::make_mut(&mut options.fontdb);
        fonts.load_font_data(dejavu::sans::regular().to_vec());
        fonts.load_font_data(dejavu::sans::bold().to_vec());
        fonts.set_sans_serif_family(FAMILY);
        Self { options }
    }

    /// An SVG file as a PNG file. Errors: it is no SVG that can be drawn.
    pub(crate) fn png(&self, svg: &str) -> Result<Vec<u8>, String> {
        let tree = Tree::from_str(svg, &self.options).map_err(|error| error.to_string())?;
        let pixels = |length: f32| (length * SCALE).ceil() as u32;
        let mut picture =
            Pixmap::new(pixels(tree.size().width()), pixels(tree.size().height())).ok_or("it has no size")?;
        resvg::render(&tree, Transform::from_scale(SCALE, SCALE), &mut picture.as_mut());
        picture.encode_png().map_err(|error| error.to_string())
    }
}

const FAMILY: &str = "DejaVu Sans";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::{figures, fixture};

    #[test]
    fn figures_are_drawn_with_their_letters() {
        let painter = Painter::new();
        let files = figures(&fixture::paper());
        let (_, svg) = files.iter().find(|(name, _)| name == "figure-3.svg").expect("Bode plots");
        let bytes = painter.png(svg).expect("a picture");
        let picture = Pixmap::decode_png(&bytes).expect("a PNG file");
        assert_eq!(picture.width(), 2000);
        // letters of the legend's first entry, right of its line: dark on white
        let dark = |picture: &Pixmap| {
            let place = (150..400).flat_map(|x| (10..45).map(move |y| (x, y)));
            place.filter(|&(x, y)| picture.pixel(x, y).is_some_and(|pixel| pixel.green() < 100)).count()
        };
        assert!(dark(&picture) > 50, "{}", dark(&picture));
        let mute = Painter { options: Options::default() };
        let silent = Pixmap::decode_png(&mute.png(svg).expect("a picture")).expect("a PNG file");
        assert!(dark(&silent) < dark(&picture) / 2, "the letters come from elsewhere");
        assert_eq!(painter.png(svg).expect("again"), bytes);
        assert!(painter.png("no picture").is_err());
    }
}
