//! The few Python literals that headers are written in.

/// Tuples in lists in tuples: the deepest real headers have 6, deeper ones are refused so that no file can exhaust the
/// stack.
const DEEPEST: usize = 32;

/// A value.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Literal {
    Text(String),
    Number(u64),
    Truth(bool),
    /// A list or a tuple.
    Row(Vec<Literal>),
    Pairs(Vec<(Literal, Literal)>),
    None,
}

impl Literal {
    /// The value of a key.
    pub(super) fn get(&self, key: &str) -> Option<&Self> {
        let Self::Pairs(pairs) = self else { return None };
        pairs.iter().find(|(name, _)| matches!(name, Self::Text(text) if text == key)).map(|(_, value)| value)
    }
}

/// Reads one value and the white space around it. Error: the character where it stops making sense.
pub(super) fn parse(text: &str) -> Result<Literal, usize> {
    let mut parser = Parser { text, at: 0 };
    let value = parser.value(0).ok_or(parser.at)?;
    parser.space();
    if parser.at == text.len() { Ok(value) } else { Err(parser.at) }
}

struct Parser<'a> {
    text: &'a str,
    at: usize,
}

impl Parser<'_> {
    fn rest(&self) -> &str {
        self.text.get(self.at..).unwrap_or_default()
    }

    fn space(&mut self) {
        self.at = self.text.len() - self.rest().trim_start().len();
    }

    fn eat(&mut self, wanted: &str) -> bool {
        self.space();
        let found = self.rest().starts_with(wanted);
        if found {
            self.at += wanted.len();
        }
        found
    }

    fn value(&mut self, depth: usize) -> Option<Literal> {
        self.space();
        if depth > DEEPEST {
            return None;
        }
        match self.rest().chars().next()? {
            quote @ ('\'' | '"') => self.quoted(quote).map(Literal::Text),
            '(' => self.row("(", ")", depth),
            '[' => self.row("[", "]", depth),
            '{' => self.pairs(depth),
            '0'..='9' => self.number(),
            _ if self.eat("True") => Some(Literal::Truth(true)),
            _ if self.eat("False") => Some(Literal::Truth(false)),
            _ if self.eat("None") => Some(Literal::None),
            _ => None,
        }
    }

    /// Escapes stay as they are, except for quotes and backslashes.
    fn quoted(&mut self, quote: char) -> Option<String> {
        let mut text = String::new();
        let mut characters = self.rest().char_indices().skip(1);
        while let Some((at, character)) = characters.next() {
            if character == quote {
                self.at += at + quote.len_utf8();
                return Some(text);
            }
            if character == '\\' {
                let (_, next) = characters.next()?;
                if !matches!(next, '\\' | '\'' | '"') {
                    text.push('\\');
                }
                text.push(next);
            } else {
                text.push(character);
            }
        }
        None
    }

    /// Python 2 wrote an `L` behind long ones.
    fn number(&mut self) -> Option<Literal> {
        let digits = self.rest().bytes().take_while(u8::is_ascii_digit).count();
        let number = self.rest().get(..digits)?.parse().ok()?;
        self.at += digits;
        if self.rest().starts_with('L') {
            self.at += 1;
        }
        Some(Literal::Number(number))
    }

    fn row(&mut self, open: &str, close: &str, depth: usize) -> Option<Literal> {
        self.eat(open);
        let mut items = Vec::new();
        while !self.eat(close) {
            items.push(self.value(depth + 1)?);
            if !self.eat(",") {
                // A single value in round brackets is itself, but headers have none: a row is what was meant.
                return self.eat(close).then_some(Literal::Row(items));
            }
        }
        Some(Literal::Row(items))
    }

    fn pairs(&mut self, depth: usize) -> Option<Literal> {
        self.eat("{");
        let mut pairs = Vec::new();
        while !self.eat("}") {
            let key = self.value(depth + 1)?;
            if !self.eat(":") {
                return None;
            }
            pairs.push((key, self.value(depth + 1)?));
            if !self.eat(",") {
                return self.eat("}").then_some(Literal::Pairs(pairs));
            }
        }
        Some(Literal::Pairs(pairs))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_are_understood() {
        let found = parse(
            "{'descr': [('a', '<f8'), (('t', 'b'), '|u1', (3,)),], 'fortran_order': False, 'shape': (3L, ), }  \n",
        );
        let found = found.unwrap();
        assert_eq!(found.get("fortran_order"), Some(&Literal::Truth(false)));
        assert_eq!(found.get("shape"), Some(&Literal::Row(vec![Literal::Number(3)])));
        let Some(Literal::Row(fields)) = found.get("descr") else { panic!("{found:?}") };
        assert_eq!(fields.len(), 2);
        assert_eq!(parse(r"'a\'b\\c\n'"), Ok(Literal::Text(r"a'b\c\n".into())));
        assert_eq!(parse("()"), Ok(Literal::Row(vec![])));
    }

    #[test]
    fn other_text_says_where_it_stops_making_sense() {
        for (text, at) in [("{'a' 1}", 5), ("-1", 0), ("", 0), ("'abc", 0), ("1 2", 2), ("99999999999999999999", 0)] {
            assert_eq!(parse(text), Err(at), "{text}");
        }
        assert!(parse(&"(".repeat(100_000)).is_err());
    }
}
