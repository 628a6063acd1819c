//! The command line with examples in the help of every command: data, parsed again by a test.

use clap::{Command, CommandFactory};

use super::Cli;

/// Command, examples, and what else is to be known.
struct Help {
    command: &'static [&'static str],
    examples: &'static [&'static str],
    further: &'static str,
}

const fn help(command: &'static [&'static str], examples: &'static [&'static str]) -> Help {
    Help { command, examples, further: "" }
}

const HELP: &[Help] = &[
    help(
        &["run"],
        &[
            "afmid run configs/paper.toml -o paper.h5",
            "afmid run configs/free-lever.toml archive/2004 -o 2004.h5",
            "afmid run configs/free-lever.toml --set 'records.files=[\"archive/*.h5\"]' --set model.order=9 -o a.h5",
            "afmid run configs/sweep-order.toml -o orders",
        ],
    ),
    help(
        &["batch"],
        &[
            "afmid batch configs/ringdown.toml archive/2004 archive/2005 -o years",
            "afmid batch configs/ringdown.toml --manifest levers.jsonl -o years --retry-failed",
            "afmid batch configs/ringdown.toml --manifest levers.jsonl -o years --shard 2/8",
        ],
    ),
    Help {
        command: &["submit", "slurm"],
        examples: &[
            "afmid submit slurm ringdown.toml --manifest levers.jsonl --shards 8 -o results",
            "afmid submit slurm ringdown.toml lever-1 lever-2 --shards 2 -o results --partition main --time 2:00:00 --memory 4G --send",
            "afmid submit slurm ringdown.toml --manifest levers.jsonl --shards 8 -o results --cpus 4 --sbatch=--nice=100 --send --json",
        ],
        further: "\
Written are FOLDER/slurm/array.sbatch (a task per shard; a lost node's tasks are queued again), collect.sbatch (the table, after the last task, however it ended)
and submit.sh, which sends both. A task succeeds when all its data sets were tried; the collecting job ends with 3 if some of them failed. To go on after time limits or
faults, submit again: what is finished is not run again.",
    },
    help(&["submit"], &["afmid submit slurm ringdown.toml --manifest levers.jsonl --shards 8 -o results"]),
    Help {
        command: &["modes"],
        examples: &[
            "afmid modes hit.csv --rate 5000 --unit m/s^2",
            "afmid modes archive/2004 -o 2004.h5",
            "afmid modes bench.mat --input u --channel y --rate 610 --json",
            "afmid modes plate.uff --goal frf",
        ],
        further: "\
Looked at are free decays, snap-offs of a lever, a measured input and output, a hammer's hits, frequency responses,
thermal noise and a steady oscillation. Written is the config of `afmid new pipeline RECORDINGS`; change it and
`afmid run` it for more. In the table `?` marks what the data do not bear out. Exit codes are those of `run`.",
    },
    help(&["compare"], &["afmid compare monday.h5 tuesday.h5", "afmid compare years/2004.h5 years/2005.h5 years/2006.h5 --json"]),
    Help {
        command: &["diagnose"],
        examples: &[
            "afmid diagnose archive/2004",
            "afmid diagnose hit.csv --rate 5000 --unit m/s^2 -o hit.h5",
            "afmid diagnose bench.mat --input u --channel y --rate 610 -o bench.h5 --json",
            "afmid diagnose axis.mat --reference qg --input vir --channel qm --rate 1000 --unit m",
        ],
        further: "\
Looked at are snap-offs of a lever, free decays, a measured input and output, an axis in its control loop (--reference) and a steady oscillation. Written is the config of
`afmid new pipeline RECORDINGS --goal diagnosis`; change it and `afmid run` it for more: parts to judge on, causes to leave out. Exit codes are those of `run`, whatever the verdict.",
    },
    help(&["new"], &["afmid new pipeline archive/2004", "afmid new stage end_noise --python"]),
    help(
        &["new", "stage"],
        &[
            "afmid new stage end_noise --python",
            "afmid new stage end_noise --rust --sources ../afmid -o end-noise",
        ],
    ),
    help(
        &["new", "cause"],
        &["afmid new cause end_stop --python", "afmid new cause uneven_segments --rust --sources ../afmid"],
    ),
    help(
        &["new", "pipeline"],
        &[
            "afmid new pipeline archive/2004 -o levers.toml",
            "afmid new pipeline recordings --goal ringdown --channel '/Group 1/deflection' --rate 5e6 --unit V",
            "afmid new pipeline bench.mat --goal diagnosis --input u --channel y --rate 610 -o bench.toml",
        ],
    ),
    help(
        &["check"],
        &[
            "afmid check configs/paper.toml configs/ringdown.toml",
            "afmid check configs/paper.toml --json",
        ],
    ),
    help(&["graph"], &["afmid graph configs/paper.toml", "afmid graph configs/paper.toml --format mermaid"]),
    help(&["explain"], &["afmid explain configs/paper.toml --set model.order=9"]),
    help(&["inspect"], &["afmid inspect archive/record_0001.tdms", "afmid inspect archive --json"]),
    help(
        &["show"],
        &[
            "afmid show paper.h5",
            "afmid show paper.h5 modes",
            "afmid show paper.h5 modes --json",
            "afmid show beam.h5 modes.diagram",
        ],
    ),
    help(&["diff"], &["afmid diff monday.h5 tuesday.h5", "afmid diff monday.h5 tuesday.h5 --exit-code"]),
    help(&["trace"], &["afmid trace paper.h5 'modes.modes[0].frequency_hz'"]),
    help(&["rerun"], &["afmid rerun paper.h5", "afmid rerun paper.h5 --data /mnt/archive -o again.h5"]),
    help(
        &["export"],
        &[
            "afmid export paper.h5 --model mat",
            "afmid export paper.h5 --model json --stage model -o lever.json",
            "afmid export beam.h5 --shapes uff -o beam.unv",
        ],
    ),
    help(
        &["export-crate"],
        &[
            "afmid export-crate paper.h5 -o paper-crate --with-data --license https://creativecommons.org/licenses/by/4.0/",
        ],
    ),
    help(&["gc"], &["afmid gc --dry-run --older-than 30d", "afmid gc --max-size 20G"]),
    help(&["report"], &["afmid report paper.h5 -o paper.html", "afmid report paper.h5 --figures figures --png"]),
    Help {
        command: &["trust"],
        examples: &["afmid trust savgol.toml", "afmid trust --list", "afmid trust --revoke savgol.toml --json"],
        further: "\
Opening a config runs nothing. `run`, `batch`, `rerun`, `exam` and the jobs of `submit` start a plugin (a command of [plugins], or afmid-stage-NAME on the PATH) only after consent for its folder,
its command with all arguments and variables, and the bytes of the program and of the files among the arguments; what a script imports is not seen. Consent is kept in $AFMID_TRUST, or
`afmid/trust` in $XDG_DATA_HOME or ~/.local/share, and ends when one of these changes. --allow-plugins starts them once without it.",
    },
    help(&["plugin"], &["afmid plugin check -- python3 savgol.py"]),
    help(
        &["plugin", "check"],
        &[
            "afmid plugin check -- python3 savgol.py",
            "afmid plugin check --timeout 300 --json -- octave-cli --quiet envelope.m",
        ],
    ),
    help(&["stages"], &["afmid stages", "afmid stages model.pem", "afmid stages model.pem --json"]),
    help(&["causes"], &["afmid causes", "afmid causes finite-rupture"]),
    help(
        &["exam"],
        &[
            "afmid exam configs/diagnose.toml --seeds 20",
            "afmid exam configs/diagnose.toml --only clean --seeds 100 --json",
        ],
    ),
    help(&["schema"], &["afmid schema"]),
    help(&["doctor"], &["afmid doctor", "afmid doctor --cache /scratch/afmid --json"]),
    help(&["completions"], &["afmid completions bash", "afmid completions zsh"]),
    help(&["man"], &["afmid man", "afmid man man1"]),
];

/// The command line as the program parses it.
pub fn command() -> Command {
    HELP.iter().fold(Cli::command(), |command, help| with(command, help.command, &text(help)))
}

fn text(help: &Help) -> String {
    let lines: String = help.examples.iter().map(|example| format!("  {example}\n")).collect();
    let further = if help.further.is_empty() { String::new() } else { format!("\n{}", help.further) };
    format!("Examples:\n{lines}{further}").trim_end().to_owned()
}

fn with(command: Command, path: &[&'static str], text: &str) -> Command {
    match path {
        [] => command.after_help(text.to_owned()),
        [first, rest @ ..] => {
            let (rest, text) = (rest.to_vec(), text.to_owned());
            command.mut_subcommand(first, move |inner| with(inner, &rest, &text))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Words of a line as a shell splits it: spaces, single quotes.
    fn words(line: &str) -> Vec<String> {
        let (mut words, mut word, mut quoted) = (Vec::new(), String::new(), false);
        for letter in line.chars() {
            match letter {
                '\'' => quoted = !quoted,
                ' ' if !quoted => words.push(std::mem::take(&mut word)),
                letter => word.push(letter),
            }
        }
        words.push(word);
        words
    }

    fn visible(command: &Command) -> Vec<Vec<String>> {
        let inner = command.get_subcommands().filter(|inner| !inner.is_hide_set() && inner.get_name() != "help");
        inner
            .flat_map(|inner| {
                let name = inner.get_name().to_owned();
                let below = visible(inner).into_iter().map(|path| [vec![name.clone()], path].concat());
                std::iter::once(vec![name.clone()]).chain(below).collect::<Vec<_>>()
            })
            .collect()
    }

    #[test]
    fn every_command_has_examples_and_every_example_is_a_command() {
        let command = command();
        for path in visible(&command) {
            assert!(HELP.iter().any(|help| help.command == path), "no example of `afmid {}`", path.join(" "));
        }
        for help in HELP {
            assert!(!help.examples.is_empty());
            for example in help.examples {
                let words = words(example);
                assert_eq!(words[1..=help.command.len()], *help.command, "{example}");
                let parsed = command.clone().try_get_matches_from(&words);
                assert!(parsed.is_ok(), "{example}: {}", parsed.unwrap_err());
            }
        }
    }

    #[test]
    fn the_definition_is_sound() {
        command().debug_assert();
    }
}
