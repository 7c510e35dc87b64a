//! Slurm: an array job and a merge after it.

use super::{Farm, File, Submission, text};
use crate::shell::quote;

/// `render.sbatch`, `merge.sbatch` and `submit.sh`.
pub(super) fn submission(farm: &Farm) -> Submission {
    let Farm { program, cwd, n_shards, threads, name, .. } = farm;
    let (cwd, program, folder) = (quote(cwd), quote(program), text(&farm.folder));
    // The bare index and the number in the text: the engine's own counts change when single tasks run again.
    let shard = farm.shard("${SLURM_ARRAY_TASK_ID}");
    let render = format!(
        "#!/bin/bash\n\
         #SBATCH --job-name={name}\n\
         #SBATCH --array=0-{last}\n\
         #SBATCH --ntasks=1\n\
         #SBATCH --cpus-per-task={threads}\n\
         #SBATCH --requeue\n\
         #SBATCH --output=render.%A_%a.log\n\
         #SBATCH --open-mode=append\n\
         #SBATCH --signal=B:TERM@60\n\
         # Exit code 75 says: interrupted and saved, run me again (RequeueExit=75 in slurm.conf does so);\n\
         # a shard that is run again goes on with its part, and leaves a finished one as it is.\n\
         set -eu\n\
         cd {cwd}\n\
         exec {program} {shard} --quiet\n",
        last = n_shards - 1
    );
    let merge = format!(
        "#!/bin/bash\n\
         #SBATCH --job-name={name}-merge\n\
         #SBATCH --ntasks=1\n\
         #SBATCH --output=merge.%j.log\n\
         #SBATCH --open-mode=append\n\
         # After any end of the array: merge itself refuses missing and unfinished parts.\n\
         set -eu\n\
         cd {cwd}\n\
         exec {program} {merge}\n",
        merge = farm.merge()
    );
    let submit = format!(
        "#!/bin/sh\n\
         # Submits the array and the merge that waits for it; arguments go to both sbatch commands.\n\
         set -eu\n\
         cd {folder}\n\
         array=$(sbatch --parsable \"$@\" render.sbatch)\n\
         array=${{array%%;*}}\n\
         merge=$(sbatch --parsable --dependency=afterany:\"$array\" \"$@\" merge.sbatch)\n\
         echo \"array $array, merge ${{merge%%;*}}\"\n",
        folder = quote(&folder)
    );
    let files = vec![
        File { name: "render.sbatch", text: render },
        File { name: "merge.sbatch", text: merge },
        File { name: "submit.sh", text: submit },
    ];
    Submission { files, command: format!("sh {}", quote(&format!("{folder}/submit.sh"))) }
}
