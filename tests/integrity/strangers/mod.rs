//! Strangers' files: opening never executes, executing asks.

mod consent;
mod containment;
mod names;

use std::cell::Cell;
use std::fs;
use std::net::UdpSocket;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

use serde_json::Value;

use super::common::{path_with, python_bin};

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

/// A config that runs the plugin of a project.
pub const CONFIG: &str = "[pipeline]\nname = \"strange\"\n[plugins]\nmine = \"python3 mine.py\"\n[[stage]]\n\
    id = \"one\"\nuses = \"exec:mine\"\n";

/// A project that somebody sent, and folders of the user's own.
pub struct Project {
    scratch: tempfile::TempDir,
    /// Where the plugin says that it was started: it can write nothing that outlives it.
    port: UdpSocket,
    started: Cell<usize>,
}

impl Project {
    /// With a plugin that is changed by these lines.
    pub fn new(changed: &str) -> Self {
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

    /// Its text.
    pub fn plugin(&self, changed: &str) -> String {
        let port = self.port.local_addr().expect("an address").port().to_string();
        format!("{HEAD}{changed}{TAIL}").replace("PORT", &port)
    }

    /// The folder with config and plugin.
    pub fn folder(&self) -> PathBuf {
        self.scratch.path().join("project")
    }

    /// The folder for temporary files.
    pub fn temporary(&self) -> PathBuf {
        self.scratch.path().join("temporary")
    }

    /// Where consent is remembered.
    pub fn trust(&self) -> PathBuf {
        self.scratch.path().join("trust")
    }

    /// Writes a file of the project.
    pub fn put(&self, name: &str, text: &str) {
        fs::write(self.folder().join(name), text).expect("a file");
    }

    /// The program in the folder, with places of its own for cache, consent and temporary files.
    pub fn command(&self, arguments: &[&str]) -> Command {
        let path = path_with(&[python_bin()]);
        let mut command = Command::new(env!("CARGO_BIN_EXE_afmid"));
        command.current_dir(self.folder()).args(arguments).env("PATH", path).env("PYTHONDONTWRITEBYTECODE", "1");
        command.env("AFMID_TRUST", self.trust()).env("AFMID_CACHE", self.scratch.path().join("cache"));
        command.env("TMPDIR", self.temporary()).stdin(Stdio::null());
        command
    }

    /// Runs it to its end.
    pub fn run(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().expect("afmid starts")
    }

    /// Its stdout, where it must go well.
    pub fn stdout(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", all(&output));
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    pub fn json(&self, arguments: &[&str]) -> Value {
        serde_json::from_str(&self.stdout(arguments)).expect("JSON")
    }

    /// How often the plugin was started so far.
    pub fn starts(&self) -> usize {
        let mut one = [0];
        while self.port.recv(&mut one).is_ok() {
            self.started.set(self.started.get() + 1);
        }
        self.started.get()
    }
}

/// Both streams.
pub fn all(output: &Output) -> String {
    String::from_utf8_lossy(&[output.stdout.as_slice(), &output.stderr].concat()).into_owned()
}
