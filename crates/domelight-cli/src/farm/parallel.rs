//! GNU parallel: one machine, or several through ssh.

use domelight::code;
use domelight::quote::{Shell, shell};

use super::{Farm, File, Submission};
use crate::error::UsageError;

/// `render.sh`, which can be run again until all is there.
///
/// # Errors
/// If the folder's name holds a brace: parallel replaces `{}` and its kin wherever they stand in its command.
pub(super) fn submission(farm: &Farm) -> Result<Submission, UsageError> {
    if farm.folder.contains('{') {
        let text = format!(
            "-o {}: GNU parallel replaces what stands in braces; choose a folder without '{{' in its path",
            farm.folder
        );
        return Err(UsageError(text));
    }
    let script = code!(
        Shell,
        "#!/bin/sh\n\
         # Renders the shards that are not done and merges them; run it again after any trouble.\n\
         # Arguments go to parallel, as in: render.sh --jobs 4 --sshlogin a,b\n\
         set -eu\n\
         cd {cwd}\n\
         if [ \"${{1-}}\" = shard ]; then\n    \
         exec {program} {shard}\n\
         fi\n\
         parallel --quote --joblog {log} --resume-failed --retries 3 --halt soon,fail=1 \"$@\" \\\n    \
         sh {itself} shard {{}} ::: $(seq 0 {last})\n\
         exec {program} {merge}\n",
        cwd = shell::word(&farm.cwd),
        program = shell::word(&farm.program),
        shard = farm.shard("\"$2\""),
        log = farm.file("joblog"),
        itself = farm.file("render.sh"),
        last = farm.n_shards - 1,
        merge = farm.merge(),
    );
    let command = code!(Shell, "sh {itself}", itself = farm.file("render.sh"));
    Ok(Submission { files: vec![File::script("render.sh", script)], command })
}
