//! What a plugin may do to the rest of the machine: write to its own folder and /dev/null, no TCP, and signals to its
//! own processes alone: it could otherwise end the host that ends it. Linux enforces it (Landlock), as far as it can.
//!
//! Reading, UDP, named sockets, and what is no byte of another file (its permissions, owner, times, extended
//! attributes) are not confined.

use std::path::Path;

use landlock::{
    ABI, Access, AccessFs, AccessNet, CompatLevel, Compatible, PathBeneath, PathFd, Ruleset, RulesetAttr,
    RulesetCreated, RulesetCreatedAttr, RulesetError, Scope,
};

/// What files and TCP need: Linux 6.7. Signals need 6.12 (V6).
const WANTED: ABI = ABI::V4;

/// Confines this process, and whatever it becomes and starts, as far as the kernel can. Errors: the kernel can, and
/// refuses.
pub(super) fn confine(folder: &Path) -> Result<(), RulesetError> {
    let mut rules: RulesetCreated = Ruleset::default()
        .handle_access(AccessFs::from_write(WANTED))?
        .handle_access(AccessNet::from_all(WANTED))?
        .scope(Scope::Signal)?
        .create()?;
    for (path, access) in
        [(folder, AccessFs::from_write(WANTED)), (Path::new("/dev/null"), AccessFs::WriteFile | AccessFs::Truncate)]
    {
        // what is not there needs no permission
        if let Ok(file) = PathFd::new(path) {
            rules = rules.add_rule(PathBeneath::new(file, access))?;
        }
    }
    rules.restrict_self().map(drop)
}

/// What of it this kernel does not enforce, in words; none if all is enforced.
pub(in crate::plugin) fn not_enforced() -> Option<String> {
    let knows = |level: ABI| {
        let hard = || Ruleset::default().set_compatibility(CompatLevel::HardRequirement);
        let files = hard().handle_access(AccessFs::from_write(level)).is_ok();
        files
            && (level < ABI::V4 || hard().handle_access(AccessNet::from_all(level)).is_ok())
            && (level < ABI::V6 || hard().scope(Scope::Signal).is_ok())
    };
    let lacks = [
        (ABI::V1, "writing to other folders"),
        (ABI::V2, "moving files between folders"),
        (ABI::V3, "truncating other files"),
        (ABI::V4, "TCP"),
        (ABI::V6, "signals to other processes"),
    ];
    let lacks: Vec<&str> = lacks.iter().filter(|(level, _)| !knows(*level)).map(|(_, what)| *what).collect();
    (!lacks.is_empty()).then(|| format!("{}: this kernel's Landlock does not know how", lacks.join(", ")))
}
