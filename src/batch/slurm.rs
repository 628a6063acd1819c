//! Job scripts of a batch for Slurm: an array with a task per shard, and a job that collects after it.

use std::ffi::OsString;
use std::path::Path;
use std::str::FromStr;

use super::shell::quoted;

/// The folder of scripts and logs, in that of the results.
pub const FOLDER: &str = "slurm";
/// The data sets, all paths absolute.
pub const MANIFEST: &str = "manifest.jsonl";
/// The config as it was when the scripts were written.
pub const CONFIG: &str = "config.toml";
/// The seals of the plugins that the jobs may start.
pub const AGREED: &str = "agreed-plugins";
/// The job array.
pub const ARRAY: &str = "array.sbatch";
/// The job that collects.
pub const COLLECT: &str = "collect.sbatch";
/// Sends both.
pub const SUBMIT: &str = "submit.sh";
/// The folder of logs, beside the scripts.
pub const LOG: &str = "log";

/// A value of an option of sbatch that is a name, a size or a time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Field(String);

impl FromStr for Field {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"._-+,:@/=".contains(&byte);
        match !text.is_empty() && text.bytes().all(plain) {
            true => Ok(Self(text.to_owned())),
            false => Err("wanted letters, digits and . _ - + , : @ / =".to_owned()),
        }
    }
}

/// An option that is handed to sbatch as it is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Passed(String);

/// Options that hold the two jobs together: another value would part them.
const OWN: [&str; 10] =
    ["array", "chdir", "dependency", "error", "help", "output", "parsable", "test-only", "wait", "wrap"];
/// The same ones' letters.
const OWN_LETTERS: &str = "aDdehoW";

impl FromStr for Passed {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.chars().any(char::is_control) {
            return Err("wanted no line breaks and control characters".to_owned());
        }
        let name = text.split('=').next().unwrap_or_default();
        let own = match name.strip_prefix("--") {
            // sbatch takes unambiguous beginnings for the whole
            Some(long) if !long.is_empty() => OWN.iter().any(|own| own.starts_with(long)),
            None => match name.strip_prefix('-').and_then(|short| short.chars().next()) {
                Some(letter) => OWN_LETTERS.contains(letter),
                None => return Err("wanted an option such as --nice=100".to_owned()),
            },
            Some(_) => return Err("wanted an option such as --nice=100".to_owned()),
        };
        match own {
            true => Err(format!("`{name}` is set by afmid itself: array and collecting job depend on it")),
            false => Ok(Self(text.to_owned())),
        }
    }
}

/// What the jobs ask of the cluster.
#[derive(Debug, Default)]
pub struct Resources<'a> {
    /// Partition.
    pub partition: Option<&'a Field>,
    /// Time limit.
    pub time: Option<&'a Field>,
    /// Memory.
    pub memory: Option<&'a Field>,
    /// Processors of a shard.
    pub cpus: u16,
    /// Account.
    pub account: Option<&'a Field>,
    /// Further options.
    pub passed: &'a [Passed],
}

/// A batch in shards.
#[derive(Debug)]
pub struct Jobs<'a> {
    /// The pipeline's name.
    pub name: &'a str,
    /// afmid itself, absolute.
    pub program: &'a Path,
    /// The config, absolute.
    pub config: &'a Path,
    /// Folder of the results, absolute.
    pub folder: &'a Path,
    /// Where stage results are kept, absolute.
    pub cache: &'a Path,
    /// Environment that configs refer to.
    pub environment: &'a [(&'static str, OsString)],
    /// `--set` arguments of all data sets.
    pub set: &'a [String],
    /// Run again what failed.
    pub retry_failed: bool,
    /// Whether there are plugins: [`AGREED`] lists those that may start.
    pub plugins: bool,
    /// How many data sets.
    pub data_sets: usize,
    /// How many shards.
    pub shards: u32,
    /// Those that hold data sets, ascending.
    pub filled: &'a [u64],
    /// What they ask for.
    pub resources: Resources<'a>,
}

impl Jobs<'_> {
    /// The script of a shard. Exit code 3, some data sets failed, is none of a failed task: it has done all that it had
    /// to, and would do the same again; what failed is in the ledger, and the collecting job ends with 3.
    pub fn array(&self) -> String {
        let tasks = ranges(self.filled);
        let what = format!("one task per shard of {} data sets", self.data_sets);
        let own = [format!("--array={tasks}"), "--requeue".to_owned()];
        let log =
            Log { folder: self.folder, slurm: "%A_%a.log", bash: "${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID.log" };
        let retry = if self.retry_failed { " --retry-failed" } else { "" };
        let count = self.shards;
        format!(
            r#"{head}
shard=${{SLURM_ARRAY_TASK_ID:?this is a task of a job array}}
echo "shard $shard/{count}, attempt $((${{SLURM_RESTART_COUNT:-0}} + 1)), node ${{SLURMD_NODENAME:-unknown}}"
"$program" batch "${{batch[@]}}" --cache {cache} --shard "$shard/{count}" -j "${{SLURM_CPUS_PER_TASK:-1}}"{retry}
code=$?
# 3: some data sets failed. The shard is done all the same, and the ledger says why; the collecting job ends with 3.
[ "$code" -ne 3 ] || code=0
exit "$code"
"#,
            head = self.head("", &what, &own, &log, self.resources.cpus),
            cache = quoted(self.cache),
        )
    }

    /// The script of the job that collects: its exit code is that of the batch.
    pub fn collect(&self) -> String {
        let log = Log { folder: self.folder, slurm: "%j_collect.log", bash: "${SLURM_JOB_ID}_collect.log" };
        let what = "the table of all data sets, when all shards have ended";
        let head = self.head("-collect", what, &["--requeue".to_owned()], &log, 1);
        format!("{head}\nexec \"$program\" batch \"${{batch[@]}}\" --collect\n")
    }

    /// What both begin with.
    fn head(&self, suffix: &str, what: &str, own: &[String], log: &Log, cpus: u16) -> String {
        let asked = [
            ("partition", self.resources.partition),
            ("time", self.resources.time),
            ("mem", self.resources.memory),
            ("account", self.resources.account),
        ];
        let mut options = vec![format!("--job-name=afmid-{}{suffix}", plain_name(self.name))];
        options.extend(own.iter().cloned());
        options.push(format!("--output={}", log.option()));
        // the log of an attempt on a lost node stays
        options.push("--open-mode=append".to_owned());
        options.push(format!("--cpus-per-task={cpus}"));
        options.extend(asked.iter().filter_map(|(name, value)| Some(format!("--{name}={}", value.as_ref()?.0))));
        options.extend(self.resources.passed.iter().map(|passed| directive(&passed.0)));
        let options: String = options.iter().map(|option| format!("#SBATCH {option}\n")).collect();
        let environment = self.environment.iter().map(|(name, value)| format!("export {name}={}\n", quoted(value)));
        let set: String = self.set.iter().map(|set| format!(" {}", quoted(format!("--set={set}")))).collect();
        format!(
            r#"#!/bin/bash
# Written by afmid {version}: {what}. {SUBMIT} sends it.
{options}
program={program}
config={config}
folder={folder}
{redirection}batch=("$config" --manifest "$folder/{FOLDER}/{MANIFEST}" -o "$folder"{set}{agreed})
# every file is written under a name of its own and renamed: no locks are needed, and not all file systems of clusters have them
export HDF5_USE_FILE_LOCKING=FALSE
{environment}
if [ "$(<"$config")" != "$(<"$folder/{FOLDER}/{CONFIG}")" ]; then
    echo "error: $config has changed since it was submitted, or cannot be read here: submit again, or put {FOLDER}/{CONFIG} back" >&2
    exit 2
fi"#,
            version = env!("CARGO_PKG_VERSION"),
            program = quoted(self.program),
            config = quoted(self.config),
            folder = quoted(self.folder),
            redirection = log.redirection(),
            agreed =
                if self.plugins { format!(" --agreed-plugins \"$folder/{FOLDER}/{AGREED}\"") } else { String::new() },
            environment = environment.collect::<String>().trim_end(),
        )
    }

    /// The script that sends both. The jobs' working directory is that of the scripts, which all nodes see.
    pub fn submit(&self) -> String {
        format!(
            r#"#!/bin/bash
# Written by afmid {version}: sends the shards, and after them, however they end, the job that collects. Prints both jobs' numbers.
set -eu
cd -- {here}
array=$(sbatch --parsable {ARRAY})
echo "array $array"
collect=$(sbatch --parsable {dependency}"${{array%%;*}}" {COLLECT})
echo "collect $collect"
"#,
            version = env!("CARGO_PKG_VERSION"),
            here = quoted(self.folder.join(FOLDER)),
            dependency = DEPENDENCY,
        )
    }
}

/// Where a job's log goes.
struct Log<'a> {
    /// Folder of the results.
    folder: &'a Path,
    /// Its name as Slurm's pattern.
    slurm: &'static str,
    /// The same in bash.
    bash: &'static str,
}

impl Log<'_> {
    /// The folder, if a directive for Slurm can name it: a backslash stops all its patterns, a directive has one line.
    fn folder(&self) -> Option<&str> {
        self.folder.to_str().filter(|folder| !folder.chars().any(|c| c.is_control() || c == '\\'))
    }

    /// The value of `--output`: preferably a file, so that Slurm's own messages of limits and kills stand in it too.
    fn option(&self) -> String {
        match self.folder() {
            Some(folder) => directive(&format!("{}/{FOLDER}/{LOG}/{}", folder.replace('%', "%%"), self.slurm)),
            None => "/dev/null".to_owned(),
        }
    }

    /// What does the same from within the script where Slurm cannot.
    fn redirection(&self) -> String {
        match self.folder() {
            Some(_) => String::new(),
            None => format!("exec >>\"$folder/{FOLDER}/{LOG}/{}\" 2>&1\n", self.bash),
        }
    }
}

/// A word in a line `#SBATCH`: quotes as in a shell, but a backslash means something within them too.
fn directive(word: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"/._-+,:@%=".contains(&byte);
    match word.bytes().all(plain) {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\\', r"\\").replace('\'', r"'\''")),
    }
}

/// How the collecting job waits for the array, before its number.
pub const DEPENDENCY: &str = "--dependency=afterany:";

/// `1-3,5` of 1, 2, 3, 5.
fn ranges(ascending: &[u64]) -> String {
    let mut parts: Vec<(u64, u64)> = Vec::new();
    for &number in ascending {
        match parts.last_mut() {
            Some((_, last)) if *last + 1 == number => *last = number,
            _ => parts.push((number, number)),
        }
    }
    let one = |(first, last): &(u64, u64)| if first == last { first.to_string() } else { format!("{first}-{last}") };
    parts.iter().map(one).collect::<Vec<_>>().join(",")
}

fn plain_name(name: &str) -> String {
    let keep = |c: char| if c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.') { c } else { '-' };
    name.chars().map(keep).take(60).collect()
}

/// The number of a job in what `sbatch --parsable` prints: `12` or `12;cluster` in the last line; some sites print
/// words of their own above.
pub fn job_id(printed: &str) -> Option<String> {
    let last = printed.lines().map(str::trim).rfind(|line| !line.is_empty())?;
    let id = last.split(';').next()?;
    (!id.is_empty() && id.bytes().all(|byte| byte.is_ascii_digit())).then(|| id.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tasks_are_ranges() {
        assert_eq!(ranges(&[1, 2, 3, 5, 7, 8]), "1-3,5,7-8");
        assert_eq!(ranges(&[4]), "4");
    }

    #[test]
    fn job_numbers_are_read() {
        assert_eq!(job_id("12\n").as_deref(), Some("12"));
        assert_eq!(job_id("welcome\n12;big \n\n").as_deref(), Some("12"));
        for none in ["", "Submitted batch job 12", ";big", "x"] {
            assert_eq!(job_id(none), None, "{none}");
        }
    }

    #[test]
    fn options_that_would_part_the_jobs_are_refused() {
        for good in ["--nice=100", "-x", "--constraint=a&b # 'c'", "--exclusive", "--mail-type=FAIL", "-Mbig"] {
            assert!(good.parse::<Passed>().is_ok(), "{good}");
        }
        for bad in ["", "nice", "--", "-", "--array=1", "--arr=1", "-a1", "--dependency=x", "-d", "--output=x", "--a\n"]
        {
            assert!(bad.parse::<Passed>().is_err(), "{bad}");
        }
        for (text, good) in
            [("4G", true), ("1-02:00:00", true), ("a,b", true), ("", false), ("a b", false), ("$x", false)]
        {
            assert_eq!(text.parse::<Field>().is_ok(), good, "{text}");
        }
    }
}
