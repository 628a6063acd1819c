//! Strangers' files: opening never executes, executing asks.

use std::cell::Cell;
use std::fs;
use std::net::{TcpListener, UdpSocket};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::common::ROOT;

/// What a plugin of the tests is: Python without any package.
const HEAD: &str = r#"import json, os, subprocess, sys, time
import socket
socket.socket(socket.AF_INET, socket.SOCK_DGRAM).sendto(b"x", ("127.0.0.1", PORT))
HERE = os.environ["TMPDIR"]
DESCRIPTION = {
    "name": "stranger", "version": "1", "summary": "does what the test wants",
    "inputs": [{"name": "table", "shape": "table", "optional": True}], "outputs": [{"name": "out", "shape": "array"}],
    "parameters": {"type": "object", "additionalProperties": False, "properties": {"gain": {"type": "number", "default": 1}}},
    "deterministic": True, "seeded": False,
}
def say(message):
    print(json.dumps(message), flush=True)
def made(values, output=None):
    axis = {"name": "n", "unit": "1", "length": 3, "values": [0, 1, 2]}
    variable = {"name": "value", "unit": "1", "dims": ["n"], "kind": "real", "values": values}
    return {"outputs": {"out": {"shape": "array", "axes": [axis], "variables": [variable]}}}
def run(params):
    return made([1, 2, 3])
def after():
    pass
"#;

/// The conversation, after what a test changes.
const TAIL: &str = r#"
say({"afmid_stage": 1, "protocol": {"min": 1, "max": 1}, "name": "stranger", "version": "1"})
for line in sys.stdin:
    request = json.loads(line)
    if request["method"] == "describe":
        say({"id": request["id"], "result": DESCRIPTION})
    elif request["method"] == "run":
        say({"id": request["id"], "result": run(request["params"])})
        after()
    elif request["method"] == "shutdown":
        break
    else:
        say({"id": request["id"], "error": {"message": "unknown method"}})
"#;

const CONFIG: &str = "[pipeline]\nname = \"strange\"\n[plugins]\nmine = \"python3 mine.py\"\n[[stage]]\nid = \"one\"\nuses = \"exec:mine\"\n";

/// A project that somebody sent, and folders of the user's own.
struct Project {
    scratch: tempfile::TempDir,
    /// Where the plugin says that it was started: it can write nothing that outlives it.
    port: UdpSocket,
    started: Cell<usize>,
}

impl Project {
    /// With a plugin that is changed by these lines.
    fn new(changed: &str) -> Self {
        let scratch = tempfile::tempdir().expect("a folder");
        for folder in ["project", "temporary"] {
            fs::create_dir(scratch.path().join(folder)).expect("a folder");
        }
        let port = UdpSocket::bind("127.0.0.1:0").expect("a port");
        port.set_nonblocking(true).expect("a port");
        let own = Self { scratch, port, started: Cell::new(0) };
        own.put("mine.py", &own.plugin(changed));
        own.put("c.toml", CONFIG);
        own
    }

    fn plugin(&self, changed: &str) -> String {
        let port = self.port.local_addr().expect("an address").port().to_string();
        format!("{HEAD}{changed}{TAIL}").replace("PORT", &port)
    }

    fn folder(&self) -> PathBuf {
        self.scratch.path().join("project")
    }

    fn temporary(&self) -> PathBuf {
        self.scratch.path().join("temporary")
    }

    fn trust(&self) -> PathBuf {
        self.scratch.path().join("trust")
    }

    fn put(&self, name: &str, text: &str) {
        fs::write(self.folder().join(name), text).expect("a file");
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let bin = Path::new(ROOT).join(".tools/bin");
        assert!(bin.join("python3").exists(), "{} has no python3: run `make test-deps`", bin.display());
        let path = std::env::var_os("PATH").unwrap_or_default();
        let path = std::env::join_paths([bin].into_iter().chain(std::env::split_paths(&path))).expect("a PATH");
        let mut command = Command::new(env!("CARGO_BIN_EXE_afmid"));
        command.current_dir(self.folder()).args(arguments).env("PATH", path).env("PYTHONDONTWRITEBYTECODE", "1");
        command.env("AFMID_TRUST", self.trust()).env("AFMID_CACHE", self.scratch.path().join("cache"));
        command.env("TMPDIR", self.temporary()).stdin(Stdio::null());
        command
    }

    fn run(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().expect("afmid starts")
    }

    /// What it prints, where it must go well.
    fn told(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", all(&output));
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    fn json(&self, arguments: &[&str]) -> Value {
        serde_json::from_str(&self.told(arguments)).expect("JSON")
    }

    /// How often the plugin was started so far.
    fn starts(&self) -> usize {
        let mut one = [0];
        while self.port.recv(&mut one).is_ok() {
            self.started.set(self.started.get() + 1);
        }
        self.started.get()
    }
}

fn all(output: &Output) -> String {
    String::from_utf8_lossy(&[output.stdout.as_slice(), &output.stderr].concat()).into_owned()
}

#[test]
fn what_only_looks_starts_nothing() {
    let project = Project::new("");
    project.told(&["run", "c.toml", "--allow-plugins", "-o", "r.h5"]);
    let before = project.starts();
    assert!(before > 0, "it was started");
    for arguments in [
        &["check", "c.toml"][..],
        &["check", "c.toml", "--json"],
        &["graph", "c.toml"],
        &["graph", "c.toml", "--json"],
        &["explain", "c.toml"],
        &["explain", "c.toml", "--json"],
        &["schema"],
        &["stages"],
        &["show", "r.h5"],
        &["show", "r.h5", "one"],
        &["inspect", "r.h5"],
        &["report", "r.h5"],
        &["trace", "r.h5", "one.out.value[0]"],
        &["diff", "r.h5", "r.h5"],
        &["export-crate", "r.h5"],
        &["doctor"],
        &["gc", "--dry-run"],
        &["trust", "--list"],
    ] {
        // whether there is something to trace is not the question
        let output = project.run(arguments);
        assert!(matches!(output.status.code(), Some(0..=2)), "{arguments:?}: {}", all(&output));
        assert_eq!(project.starts(), before, "{arguments:?} started a plugin");
    }
}

#[test]
fn nothing_starts_before_consent_and_the_error_says_how_to_give_it() {
    let project = Project::new("");
    fs::create_dir(project.folder().join("set")).expect("a folder");
    project.put("set/a.h5", "");
    let records = format!(
        "{CONFIG}[[stage]]\nid = \"records\"\nuses = \"io.records\"\nparams = {{ files = [\"set/*.h5\"], channel = \"/d\" }}\n"
    );
    project.put("b.toml", &records);
    project.told(&["run", "c.toml", "--allow-plugins", "-o", "r.h5"]);
    let before = project.starts();
    assert!(before > 0, "it was started");
    for arguments in [
        &["run", "c.toml", "-o", "a.h5"][..],
        &["batch", "b.toml", "set", "-o", "sets"],
        &["rerun", "r.h5"],
        &["exam", "c.toml", "--seeds", "1"],
        &["submit", "slurm", "b.toml", "set", "--shards", "1", "-o", "jobs"],
    ] {
        let output = project.run(arguments);
        let told = all(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {told}");
        for word in ["afmid trust", "--allow-plugins", "python3 mine.py", "`mine`"] {
            assert!(told.contains(word), "{arguments:?} lacks {word}: {told}");
        }
        assert_eq!(project.starts(), before, "{arguments:?} started a plugin");
    }
    assert!(!project.folder().join("a.h5").exists());
}

#[test]
fn ports_are_checked_after_consent_and_without_starting_anything() {
    let project = Project::new("");
    let wrong = CONFIG.to_owned()
        + "params = { gian = 2 }\n[[stage]]\nid = \"two\"\nuses = \"exec:mine\"\ninputs = { table = \"one.nothing\" }\n";
    project.put("wrong.toml", &wrong);
    let before = project.told(&["check", "wrong.toml"]);
    assert!(before.contains("ports not checked") && before.contains("one") && before.contains("two"), "{before}");
    let before = project.json(&["check", "wrong.toml", "--json"]);
    assert_eq!((&before[0]["right"], &before[0]["ports_not_checked"]), (&json!(true), &json!(["one", "two"])));
    assert!(project.told(&["graph", "wrong.toml"]).contains("table <- one.nothing"));
    let explained = project.json(&["explain", "c.toml", "--json"]);
    assert_eq!(explained["stages"][0]["would"], "unknown", "{explained}");

    let listed = project.told(&["trust", "wrong.toml"]);
    let folder = project.folder().canonicalize().expect("a folder");
    for word in ["python3", "mine.py", &folder.display().to_string(), "blake3:", "stranger 1", "table", "out"] {
        assert!(listed.contains(word), "no {word} in {listed}");
    }
    assert_eq!(project.starts(), 1);
    let after = project.run(&["check", "wrong.toml"]);
    let told = all(&after);
    assert_eq!(after.status.code(), Some(2), "{told}");
    assert!(told.contains("no parameter `gian`") && told.contains("no output `nothing`"), "{told}");
    assert_eq!(project.json(&["check", "c.toml", "--json"])[0]["ports_not_checked"], json!([]));
    assert_eq!(project.json(&["explain", "c.toml", "--json"])["stages"][0]["would"], "run");
    assert_eq!(project.starts(), 1, "it was asked once");

    project.told(&["run", "c.toml", "-o", "a.h5"]);
    assert_eq!(project.json(&["explain", "c.toml", "--json"])["stages"][0]["would"], "reuse");
    let list = project.json(&["trust", "--list", "--json"]);
    assert_eq!(list["plugins"][0]["identity"], "stranger 1", "{list}");
    project.told(&["trust", "--revoke", "c.toml"]);
    assert_eq!(project.run(&["run", "c.toml", "-o", "a.h5"]).status.code(), Some(2));

    // what is there no more can be revoked, too
    project.told(&["trust", "c.toml"]);
    project.put("c.toml", &CONFIG.replace("python3 mine.py", "./gone mine.py"));
    let revoked = project.json(&["trust", "--revoke", "c.toml", "--json"]);
    assert_eq!(revoked["plugins"][0]["program"], serde_json::Value::Null, "{revoked}");
    assert_eq!(project.json(&["trust", "--list", "--json"])["plugins"], json!([]));
}

#[test]
fn a_changed_file_command_folder_or_variable_asks_again() {
    let project = Project::new("");
    project.told(&["trust", "c.toml"]);
    let runs = |config: &str| project.run(&["run", config, "-o", "a.h5"]).status.code();
    assert_eq!(runs("c.toml"), Some(0));
    for (name, command) in [
        ("other.toml", "\"python3 mine.py --more\""),
        ("fewer.toml", "\"python3 -B mine.py\""),
        ("with.toml", "{ command = \"python3 mine.py\", environment = { GAIN = \"2\" } }"),
    ] {
        project.put(name, &CONFIG.replace("\"python3 mine.py\"", command));
        let before = project.starts();
        assert_eq!((runs(name), project.starts()), (Some(2), before), "{command}");
    }
    // the same time limit or name are nobody's concern
    project.put(
        "same.toml",
        &CONFIG.replace("\"python3 mine.py\"", "{ command = [\"python3\", \"mine.py\"], timeout_s = 60 }"),
    );
    assert_eq!(runs("same.toml"), Some(0));
    let elsewhere = project.folder().join("elsewhere");
    fs::create_dir(&elsewhere).expect("a folder");
    for name in ["c.toml", "mine.py"] {
        fs::copy(project.folder().join(name), elsewhere.join(name)).expect("a copy");
    }
    assert_eq!(runs("elsewhere/c.toml"), Some(2), "another folder");
    let (text, before) = (fs::read_to_string(project.folder().join("mine.py")).expect("a script"), project.starts());
    project.put("mine.py", &(text.clone() + "# changed\n"));
    assert_eq!((runs("c.toml"), project.starts()), (Some(2), before));
    project.put("mine.py", &text);
    assert_eq!(runs("c.toml"), Some(0), "what was agreed to is the same again");
}

#[test]
fn damaged_consent_is_none_and_lies_with_the_user_alone() {
    let project = Project::new("");
    project.told(&["trust", "c.toml"]);
    let entries: Vec<PathBuf> =
        fs::read_dir(project.trust()).expect("the folder").flatten().map(|entry| entry.path()).collect();
    let [entry] = &entries[..] else { panic!("{entries:?}") };
    assert_eq!(fs::metadata(project.trust()).expect("the folder").permissions().mode() & 0o077, 0);
    let (whole, before) = (fs::read(entry).expect("consent"), project.starts());
    let refused = |bytes: &[u8], what: &str| {
        fs::write(entry, bytes).expect("written");
        let output = project.run(&["run", "c.toml", "-o", "a.h5"]);
        assert_eq!((output.status.code(), project.starts()), (Some(2), before), "{what}: {}", all(&output));
    };
    for at in (0..whole.len()).step_by(whole.len() / 7) {
        let mut flipped = whole.clone();
        flipped[at] ^= 1;
        refused(&flipped, &format!("byte {at}"));
    }
    refused(&whole[..whole.len() / 2], "cut short");
    refused(b"", "empty");
    fs::write(entry, &whole).expect("written");
    project.told(&["run", "c.toml", "-o", "a.h5"]);
    // another plugin's consent under this one's name, and one that the project brings along
    project.put("c.toml", &CONFIG.replace("mine.py", "mine.py --more"));
    let other = project.json(&["trust", "c.toml", "--json"])["plugins"][0]["seal"].as_str().expect("a seal").to_owned();
    fs::copy(entry, project.trust().join(other)).expect("a copy");
    assert_eq!(project.run(&["run", "c.toml", "-o", "a.h5"]).status.code(), Some(2));
    let own = project.folder().join(".local/share/afmid/trust");
    fs::create_dir_all(&own).expect("a folder");
    fs::copy(entry, own.join(entry.file_name().expect("a name"))).expect("a copy");
    fs::remove_dir_all(project.trust()).expect("removed");
    project.put("c.toml", CONFIG);
    assert_eq!(project.run(&["run", "c.toml", "-o", "a.h5"]).status.code(), Some(2));
}

#[test]
fn jobs_of_a_submission_get_the_plugins_that_were_agreed_to_and_no_others() {
    let project = Project::new("");
    fs::create_dir(project.folder().join("set")).expect("a folder");
    project.put("set/a.h5", "no record");
    let records = format!(
        "{CONFIG}[[stage]]\nid = \"records\"\nuses = \"io.records\"\nparams = {{ files = [\"set/*.h5\"], channel = \"/d\" }}\n"
    );
    project.put("b.toml", &records);
    let submit = ["submit", "slurm", "b.toml", "set", "--shards", "1", "-o", "jobs"];
    project.told(&["trust", "b.toml"]);
    let before = project.starts();
    project.told(&submit);
    assert_eq!(project.starts(), before, "a submission starts nothing");
    // a node has no consent of its own
    fs::remove_dir_all(project.trust()).expect("removed");
    let script = fs::read_to_string(project.folder().join("jobs/slurm/array.sbatch")).expect("a script");
    assert!(script.contains("--agreed-plugins"), "{script}");
    let work = || {
        let job = project.command(&[]);
        let mut shell = Command::new("bash");
        shell.args(["jobs/slurm/array.sbatch"]).current_dir(project.folder()).env("SLURM_ARRAY_TASK_ID", "1");
        for (name, value) in job.get_envs() {
            shell.env(name, value.expect("a value"));
        }
        shell.output().expect("bash starts")
    };
    let done = work();
    assert_eq!(done.status.code(), Some(0), "{}", all(&done));
    // its record cannot be read: the plugin has run all the same
    assert!(project.starts() > before, "{}", all(&done));
    let text = fs::read_to_string(project.folder().join("mine.py")).expect("a script");
    project.put("mine.py", &(text + "# changed\n"));
    let before = project.starts();
    let refused = work();
    assert_eq!((refused.status.code(), project.starts()), (Some(2), before), "{}", all(&refused));
}

#[test]
fn links_in_and_to_an_output_file_are_refused() {
    let secret = "import h5py\nsecret = os.path.join(HERE, 'secret.h5')\nwith h5py.File(secret, 'w') as f: f['v'] = [1.5, 2.5, 3.5]\n";
    let answer = |write: &str| {
        format!("{secret}def run(params):\n    path = params['output']\n{write}\n    return made('/v')\n")
    };
    for (name, write, wanted) in [
        (
            "soft",
            "    with h5py.File(path, 'w') as f:\n        f['w'] = [1.0, 2.0, 3.0]\n        f['v'] = h5py.SoftLink('/w')",
            "link",
        ),
        ("external", "    with h5py.File(path, 'w') as f: f['v'] = h5py.ExternalLink(secret, '/v')", "link"),
        (
            "beside",
            "    with h5py.File(path, 'w') as f:\n        f['v'] = [1.0, 2.0, 3.0]\n        f['g/other'] = h5py.ExternalLink(secret, '/v')",
            "link",
        ),
        (
            "storage",
            "    raw = os.path.join(HERE, 'raw')\n    open(raw, 'wb').write(bytes(24))\n    with h5py.File(path, 'w') as f: f.create_dataset('v', (3,), 'f8', external=[(raw, 0, 24)])",
            "another file",
        ),
        (
            "virtual",
            "    layout = h5py.VirtualLayout(shape=(3,), dtype='f8')\n    layout[:] = h5py.VirtualSource(secret, 'v', shape=(3,))\n    with h5py.File(path, 'w') as f: f.create_virtual_dataset('v', layout)",
            "another file",
        ),
        ("symlink", "    os.symlink(secret, path)", "a link"),
        (
            "hard link",
            "    import shutil\n    os.link(shutil.copy(secret, os.path.dirname(path)), path)",
            "another name",
        ),
    ] {
        let project = Project::new(&answer(write));
        let output = project.run(&["run", "c.toml", "--allow-plugins", "-o", "a.h5"]);
        let told = all(&output);
        assert_eq!(output.status.code(), Some(1), "{name}: {told}");
        assert!(told.contains(wanted) && told.contains("`out`"), "{name}: {told}");
    }
    let fine = Project::new(&answer("    with h5py.File(path, 'w') as f: f['v'] = [1.0, 2.0, 3.0]"));
    fine.told(&["run", "c.toml", "--allow-plugins", "-o", "a.h5"]);
}

/// The largest resident set of a process so far, in bytes.
fn peak(pid: u32) -> Option<u64> {
    let status = fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? * 1024)
}

#[test]
fn what_a_plugin_says_unasked_is_an_error_and_takes_no_memory() {
    // a gigabyte, while a second plugin gives the first time
    let flood = "def after():\n    line = 'x' * (1 << 20)\n    for _ in range(1 << 10): print(line, flush=True)\n";
    let project = Project::new(flood);
    project.put("slow.py", &project.plugin("def run(params):\n    time.sleep(2)\n    return made([1, 2, 3])\n"));
    project.put(
        "c.toml",
        &(CONFIG.replace("[[stage]]", "slow = \"python3 slow.py\"\n[[stage]]")
            + "[[stage]]\nid = \"two\"\nuses = \"exec:slow\"\n"),
    );
    let mut child = project
        .command(&["run", "c.toml", "--allow-plugins", "-o", "a.h5"])
        .stderr(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .expect("afmid starts");
    let mut most = 0;
    while child.try_wait().expect("it can be waited for").is_none() {
        most = most.max(peak(child.id()).unwrap_or(0));
        std::thread::sleep(Duration::from_millis(20));
    }
    let output = child.wait_with_output().expect("it ended");
    assert_eq!(output.status.code(), Some(1), "{}", all(&output));
    assert!(all(&output).contains("without being asked"), "{}", all(&output));
    // what the program takes without a flood is below 100 MB
    assert!(most > 0 && most < 256 << 20, "{most} bytes");
}

/// The processes of these numbers that live.
fn living(pids: &str) -> Vec<String> {
    let alive = |pid: &&str| {
        let stat = fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
        stat.rsplit_once(')').is_some_and(|(_, rest)| !rest.trim_start().starts_with(['Z', 'X']))
    };
    pids.split_whitespace().filter(alive).map(str::to_owned).collect()
}

fn wait_until(what: &str, is_so: impl Fn() -> bool) {
    let clock = Instant::now();
    while !is_so() {
        assert!(clock.elapsed() < Duration::from_secs(60), "{what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// A plugin that starts a child and a daemon of its own session, writes down all their numbers, and hears neither the end of its input nor any
/// signal that can be ignored.
const DEAF: &str = r#"import signal
def run(params):
    for name in ("SIGTERM", "SIGHUP", "SIGINT", "SIGPIPE"): signal.signal(getattr(signal, name), signal.SIG_IGN)
    child = subprocess.Popen(["sleep", "600"])
    os.chdir(HERE)
    daemon = subprocess.Popen(["sh", "-c", "setsid sh -c 'echo $$ >daemon; exec sleep 600' </dev/null >/dev/null 2>&1 &"])
    daemon.wait()
    while not os.path.exists("daemon") or not open("daemon").read().strip(): time.sleep(0.01)
    open("pids.tmp", "w").write(f"{os.getpid()} {child.pid} {open('daemon').read()}")
    os.rename("pids.tmp", "pids")
    time.sleep(600)
"#;

#[test]
fn plugins_and_their_daemons_die_with_the_program_and_leave_nothing() {
    for end in ["kill -9", "time limit"] {
        let project = Project::new(DEAF);
        let limit = if end == "time limit" { "5" } else { "600" };
        let command = format!("{{ command = \"python3 mine.py\", timeout_s = {limit} }}");
        project.put("c.toml", &CONFIG.replace("\"python3 mine.py\"", &command));
        let run = || -> Child {
            let mut command = project.command(&["run", "c.toml", "--allow-plugins", "-o", "a.h5"]);
            command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("afmid starts")
        };
        let mut child = run();
        let pids = || {
            let folders = fs::read_dir(project.temporary()).expect("the folder").flatten();
            folders.filter_map(|folder| fs::read_to_string(folder.path().join("tmp/pids")).ok()).next()
        };
        wait_until("the plugin did not begin", || pids().is_some());
        let pids = pids().expect("its numbers");
        if end == "kill -9" {
            assert_eq!(living(&pids).len(), 3);
            child.kill().expect("it is killed");
        }
        child.wait().expect("it ended");
        wait_until(&format!("{end}: processes live on"), || living(&pids).is_empty());
        let left = || fs::read_dir(project.temporary()).expect("the folder").count();
        wait_until(&format!("{end}: something is left in the temporary folder"), || left() == 0);
    }
}

/// Tries what a plugin may not do, and says what was possible.
const BOLD: &str = r#"
def tried(what):
    try:
        what()
        return True
    except OSError:
        return False
def run(params):
    done = {
        "config": tried(lambda: open("c.toml", "a").close()),
        "beside": tried(lambda: open("beside", "w").write("x")),
        "home": tried(lambda: open(os.path.expanduser("~/afmid-was-here"), "w").close()),
        "moved": tried(lambda: os.rename("moved", os.path.join(HERE, "moved"))),
        "child": subprocess.call(["sh", "-c", "echo x >child 2>/dev/null"], stderr=subprocess.DEVNULL) == 0,
        "tcp": tried(lambda: socket.create_connection(("127.0.0.1", LISTENER), 5).close()),
        "temporary": tried(lambda: open(os.path.join(HERE, "mine"), "w").write("x")),
        "null": tried(lambda: open("/dev/null", "w").write("x")),
    }
    print(json.dumps(done), file=sys.stderr, flush=True)
    return made([float(done[name]) for name in ("config", "tcp", "temporary")])
"#;

#[test]
fn a_plugin_writes_to_its_own_folder_alone_and_what_is_not_enforced_is_in_the_result() {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = listener.local_addr().expect("an address").port().to_string();
    let project = Project::new(&BOLD.replace("LISTENER", &port));
    let log = |config: &str| {
        let mut run = project.command(&["run", config, "--allow-plugins", "-o", "a.h5"]);
        let output = run.env("HOME", project.temporary()).output().expect("afmid starts");
        assert!(output.status.success(), "{}", all(&output));
        let read =
            "import h5py, sys; r = h5py.File('a.h5')['entry/run']; print('\\n'.join(t.decode() for t in r['log'][()]))";
        let python = Path::new(ROOT).join(".tools/bin/python3");
        let read =
            Command::new(python).args(["-c", read]).current_dir(project.folder()).output().expect("python starts");
        String::from_utf8(read.stdout).expect("text")
    };
    let possible = |log: &str| -> Value {
        serde_json::from_str(log.lines().find(|line| line.starts_with('{')).unwrap_or_else(|| panic!("{log}")))
            .expect("JSON")
    };
    project.put("moved", "x");
    let confined = log("c.toml");
    let found = possible(&confined);
    // a kernel that cannot enforce something says so in the result; here and in CI it can
    if !confined.contains("not enforced") {
        let wanted = json!({
            "config": false, "beside": false, "home": false, "moved": false, "child": false, "tcp": false, "temporary": true, "null": true,
        });
        assert_eq!(found, wanted);
        assert!(project.folder().join("moved").exists() && !project.folder().join("child").exists());
    }
    let free = CONFIG.replace("\"python3 mine.py\"", "{ command = \"python3 mine.py --free\", confined = false }");
    project.put("free.toml", &free);
    let told = log("free.toml");
    assert!(told.contains("[afmid] not enforced: where it writes, TCP"), "{told}");
    assert_eq!((&possible(&told)["beside"], &possible(&told)["tcp"]), (&json!(true), &json!(true)));
    project.put("free.toml", &free.replace("--free", ""));
    let listed = project.told(&["trust", "free.toml"]);
    assert!(listed.contains("it may write anywhere"), "{listed}");
    project.put("free.toml", &free.replace("--free", "").replace("confined = false", "confined = true"));
    assert_eq!(project.run(&["run", "free.toml", "-o", "b.h5"]).status.code(), Some(2), "that is another plugin");
}
