//! The graph for people: text, Mermaid, DOT.

use std::fmt::Write;

use super::{Node, Plan};

/// How to draw a graph.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Aligned text.
    Text,
    /// Mermaid, which many Markdown viewers draw.
    Mermaid,
    /// Graphviz.
    Dot,
}

impl Plan {
    /// Draws the graph.
    pub fn render(&self, format: Format) -> String {
        match format {
            Format::Text => self.text(),
            Format::Mermaid => self.mermaid(),
            Format::Dot => self.dot(),
        }
    }

    fn text(&self) -> String {
        let longest = |name: fn(&Node) -> &str| self.nodes.iter().map(|node| name(node).len()).max().unwrap_or(0);
        let (ids, uses) = (longest(|node| &node.id), longest(|node| &node.uses));
        let count = self.nodes.len();
        let stages = if count == 1 { "stage" } else { "stages" };
        let mut text = format!("{} (seed {}): {count} {stages}\n", self.config.name, self.config.seed);
        for node in &self.nodes {
            let wires: Vec<String> = node
                .inputs
                .iter()
                .map(|wire| format!("{} <- {}.{}", wire.port, self.nodes[wire.node].id, wire.output))
                .collect();
            let line = format!("{:ids$}  {:uses$}  {}", node.id, node.uses, wires.join(", "));
            text.push_str(line.trim_end());
            text.push('\n');
        }
        self.sweep(&mut text, "");
        text
    }

    /// A line on the sweep, if there is one: its points differ in parameters, not in the graph.
    fn sweep(&self, text: &mut String, mark: &str) {
        let Some(points) = self.points() else { return };
        let swept = self.config.sweep.iter().map(|swept| format!("{} ({})", swept.name, swept.values.len()));
        let (many, swept) = (if points == 1 { "" } else { "s" }, swept.collect::<Vec<_>>().join(", "));
        let _ = writeln!(text, "{mark}sweep: {points} point{many}, the same graph in each: {swept}");
    }

    fn mermaid(&self) -> String {
        let mut text = "flowchart TD\n".to_owned();
        self.sweep(&mut text, "    %% ");
        self.draw(
            &mut text,
            |index, node| format!("    n{index}[\"{}<br/>{}\"]", node.id, node.uses),
            |from, to, label| format!("    n{from} -- \"{label}\" --> n{to}"),
        );
        text
    }

    fn dot(&self) -> String {
        let name = self.config.name.replace(['"', '\\'], "_");
        let mut text = format!("digraph \"{name}\" {{\n    node [shape=box];\n");
        self.sweep(&mut text, "    // ");
        self.draw(
            &mut text,
            |index, node| format!("    n{index} [label=\"{}\\n{}\"];", node.id, node.uses),
            |from, to, label| format!("    n{from} -> n{to} [label=\"{label}\"];"),
        );
        text.push_str("}\n");
        text
    }

    fn draw(
        &self,
        text: &mut String,
        node_line: impl Fn(usize, &Node) -> String,
        wire_line: impl Fn(usize, usize, &str) -> String,
    ) {
        // writing to a String cannot fail
        for (index, node) in self.nodes.iter().enumerate() {
            let _ = writeln!(text, "{}", node_line(index, node));
        }
        for (index, node) in self.nodes.iter().enumerate() {
            for wire in &node.inputs {
                let same = wire.port == wire.output;
                let label = if same { wire.port.to_owned() } else { format!("{} to {}", wire.output, wire.port) };
                let _ = writeln!(text, "{}", wire_line(wire.node, index, &label));
            }
        }
    }
}
