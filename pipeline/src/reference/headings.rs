//! The headings of a stage's doc comment.

/// The headings of a stage's doc comment, in this order. `Source` may be left out: then it is the spec's.
pub const HEADINGS: [&str; 7] = ["Model", "Method", "Shapes", "Units", "Accuracy", "Errors", "Source"];

/// A doc comment, taken apart at its headings.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Sections {
    /// What comes before the first heading.
    pub intro: String,
    /// Heading and text, in the order of the comment.
    pub sections: Vec<(&'static str, String)>,
}

impl Sections {
    /// Takes a doc comment apart. A heading is one of [`HEADINGS`] as `# Method` or, at the start of a line, as
    /// `Method:`.
    ///
    /// ```
    /// use afmid_pipeline::reference::Sections;
    /// let doc = Sections::of("A sine.\n\nModel: `y = sin x`.\n\n# Source\n\nany textbook");
    /// assert_eq!(doc.intro, "A sine.");
    /// assert_eq!(doc.sections[0], ("Model", "`y = sin x`.".to_owned()));
    /// assert_eq!(doc.sections[1], ("Source", "any textbook".to_owned()));
    /// ```
    pub fn of(doc: &str) -> Self {
        let (mut found, mut fenced) = (Self::default(), false);
        for line in doc.lines() {
            let heading = if fenced { None } else { heading(line) };
            if line.trim_start().starts_with("```") {
                fenced = !fenced;
            }
            match heading {
                Some((name, rest)) => found.sections.push((name, rest.to_owned())),
                None => {
                    let text = found.sections.last_mut().map_or(&mut found.intro, |(_, text)| text);
                    text.push('\n');
                    text.push_str(line);
                }
            }
        }
        found.intro = found.intro.trim().to_owned();
        for (_, text) in &mut found.sections {
            *text = text.trim().to_owned();
        }
        found
    }

    /// The text under a heading.
    pub fn get(&self, heading: &str) -> Option<&str> {
        self.sections.iter().find(|(name, _)| *name == heading).map(|(_, text)| text.as_str())
    }
}

/// The heading that a line begins, and what follows it in the line.
fn heading(line: &str) -> Option<(&'static str, &str)> {
    let known = |word: &str| HEADINGS.into_iter().find(|heading| *heading == word);
    if let Some(title) = line.strip_prefix('#') {
        return known(title.trim_start_matches('#').trim()).map(|name| (name, ""));
    }
    let (word, rest) = line.split_once(':')?;
    known(word.trim()).map(|name| (name, rest.trim()))
}
