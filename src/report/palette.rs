//! Colours by name, in light and in dark. Data colours after Okabe and Ito (distinguishable with colour-blind eyes),
//! darkened or lightened until they stand out from their ground by at least 3 to 1 (WCAG 2.2, 1.4.11).

/// Name, light, dark.
const COLOURS: [(&str, &str, &str); 18] = [
    ("paper", "#ffffff", "#15181c"),
    ("surface", "#f5f6f8", "#1d2127"),
    ("edge", "#dfe3e8", "#30363e"),
    ("ink", "#1a1d21", "#e9ebee"),
    ("muted", "#5a6470", "#9ba5b1"),
    ("grid", "#e4e7eb", "#2b3138"),
    ("minor", "#f1f3f5", "#20252b"),
    ("rule", "#8a94a0", "#77828e"),
    ("accent", "#005f94", "#6bbcec"),
    ("warn", "#8a4b00", "#f5b95f"),
    ("warn-ground", "#fff6e5", "#33280f"),
    ("blue", "#0072b2", "#5cb5ea"),
    ("vermillion", "#d55e00", "#f58b4c"),
    ("green", "#00845f", "#2fc79b"),
    ("purple", "#b2568d", "#e29cc4"),
    ("sky", "#2a8fc4", "#38bdf8"),
    ("orange", "#b97800", "#eebf4d"),
    ("shade", "#0000000a", "#ffffff0a"),
];

/// The style sheet's variables: light unless a screen asks for dark.
pub(super) fn variables() -> String {
    let list = |dark: bool| -> String {
        COLOURS.iter().map(|(name, light, night)| format!("--{name}:{};", if dark { night } else { light })).collect()
    };
    format!(
        ":root{{color-scheme:light dark;{}}}\n@media screen and (prefers-color-scheme:dark){{:root{{{}}}}}\n",
        list(false),
        list(true)
    )
}

/// A style sheet with every variable replaced by its light value, for files that are read by programs without CSS
/// variables.
pub(super) fn in_light(style: &str) -> String {
    COLOURS.iter().fold(style.to_owned(), |style, (name, light, _)| style.replace(&format!("var(--{name})"), light))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance (WCAG).
    fn luminance(hex: &str) -> f64 {
        let channel = |at: usize| {
            let value = f64::from(u8::from_str_radix(&hex[at..at + 2], 16).expect("hexadecimal")) / 255.0;
            if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * channel(1) + 0.7152 * channel(3) + 0.0722 * channel(5)
    }

    fn contrast(a: &str, b: &str) -> f64 {
        let (a, b) = (luminance(a), luminance(b));
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    fn colour(name: &str) -> (&'static str, &'static str) {
        COLOURS.iter().find(|row| row.0 == name).map(|row| (row.1, row.2)).expect("a colour of the palette")
    }

    #[test]
    fn text_and_curves_stand_out_in_light_and_dark() {
        // WCAG 2.2 AA: 4.5 for text (1.4.3), 3 for graphics (1.4.11)
        for (name, wanted) in [
            ("ink", 4.5),
            ("muted", 4.5),
            ("accent", 4.5),
            ("rule", 3.0),
            ("blue", 3.0),
            ("vermillion", 3.0),
            ("green", 3.0),
            ("purple", 3.0),
            ("sky", 3.0),
            ("orange", 3.0),
        ] {
            let ((light, dark), (paper_light, paper_dark)) = (colour(name), colour("paper"));
            assert!(contrast(light, paper_light) >= wanted, "{name} on light: {:.2}", contrast(light, paper_light));
            assert!(contrast(dark, paper_dark) >= wanted, "{name} on dark: {:.2}", contrast(dark, paper_dark));
        }
        let (warn, ground) = (colour("warn"), colour("warn-ground"));
        assert!(contrast(warn.0, ground.0) >= 4.5 && contrast(warn.1, ground.1) >= 4.5);
    }

    #[test]
    fn exported_figures_need_no_variables() {
        assert!(!in_light(include_str!("figure.css")).contains("var("));
    }
}
