//! GNU parallel: one machine, or several through ssh.

use super::{Farm, File, Submission, text};
use crate::shell::quote;

/// `render.sh`, which can be run again until all is there.
pub(super) fn submission(farm: &Farm) -> Submission {
    let Farm { program, cwd, n_shards, .. } = farm;
    let folder = text(&farm.folder);
    let program = quote(program);
    let script = format!(
        "#!/bin/sh\n\
         # Renders the shards that are not done and merges them; run it again after any trouble.\n\
         # Arguments go to parallel, as in: render.sh --jobs 4 --sshlogin a,b\n\
         set -eu\n\
         cd {cwd}\n\
         if [ \"${{1-}}\" = shard ]; then\n    \
         exec {program} {shard} --quiet\n\
         fi\n\
         parallel --quote --joblog {log} --resume-failed --retries 3 --halt soon,fail=1 \"$@\" \\\n    \
         sh {itself} shard {{}} ::: $(seq 0 {last})\n\
         exec {program} {merge}\n",
        cwd = quote(cwd),
        shard = farm.shard("$2"),
        log = quote(&format!("{folder}/joblog")),
        itself = quote(&format!("{folder}/render.sh")),
        last = n_shards - 1,
        merge = farm.merge(),
    );
    let files = vec![File { name: "render.sh", text: script }];
    Submission { files, command: format!("sh {}", quote(&format!("{folder}/render.sh"))) }
}
