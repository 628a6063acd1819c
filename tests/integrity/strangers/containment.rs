//! What a plugin that runs cannot do: outlive the program, fill its memory, write elsewhere, lead it into other files.

use std::fs;
use std::net::TcpListener;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::super::common::python_bin;
use super::{CONFIG, Project, all};

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
        let message = all(&output);
        assert_eq!(output.status.code(), Some(1), "{name}: {message}");
        assert!(message.contains(wanted) && message.contains("`out`"), "{name}: {message}");
    }
    let fine = Project::new(&answer("    with h5py.File(path, 'w') as f: f['v'] = [1.0, 2.0, 3.0]"));
    fine.stdout(&["run", "c.toml", "--allow-plugins", "-o", "a.h5"]);
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

/// A plugin that starts a child and a daemon of its own session, writes down all their numbers, and hears neither the
/// end of its input nor any signal that can be ignored.
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
        "signal": tried(lambda: os.kill(os.getppid(), 0)),
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
        let python = python_bin().join("python3");
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
            "signal": false,
        });
        assert_eq!(found, wanted);
        assert!(project.folder().join("moved").exists() && !project.folder().join("child").exists());
    }
    let free = CONFIG.replace("\"python3 mine.py\"", "{ command = \"python3 mine.py --free\", confined = false }");
    project.put("free.toml", &free);
    let text = log("free.toml");
    assert!(text.contains("[afmid] not enforced: where it writes, TCP"), "{text}");
    assert_eq!((&possible(&text)["beside"], &possible(&text)["tcp"]), (&json!(true), &json!(true)));
    project.put("free.toml", &free.replace("--free", ""));
    let listed = project.stdout(&["trust", "free.toml"]);
    assert!(listed.contains("it may write anywhere"), "{listed}");
    project.put("free.toml", &free.replace("--free", "").replace("confined = false", "confined = true"));
    assert_eq!(project.run(&["run", "free.toml", "-o", "b.h5"]).status.code(), Some(2), "that is another plugin");
}
