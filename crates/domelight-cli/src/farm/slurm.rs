//! Slurm: an array job and a merge after it.

use domelight::code;
use domelight::quote::{Shell, shell};

use super::{Farm, File, Submission};

/// `render.sbatch`, `merge.sbatch` and `submit.sh`.
pub(super) fn submission(farm: &Farm) -> Submission {
    let Farm { name, threads, .. } = farm;
    let render = code!(
        Shell,
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
         exec {program} {shard}\n",
        name = shell::word(name),
        last = farm.n_shards - 1,
        threads = *threads,
        cwd = shell::word(&farm.cwd),
        program = shell::word(&farm.program),
        // The bare index and the number in the text: the engine's own counts change when single tasks run again.
        shard = farm.shard("\"${SLURM_ARRAY_TASK_ID}\""),
    );
    let merge = code!(
        Shell,
        "#!/bin/bash\n\
         #SBATCH --job-name={name}-merge\n\
         #SBATCH --ntasks=1\n\
         #SBATCH --output=merge.%j.log\n\
         #SBATCH --open-mode=append\n\
         # After any end of the array: merge itself refuses missing and unfinished parts.\n\
         set -eu\n\
         cd {cwd}\n\
         exec {program} {merge}\n",
        name = shell::word(name),
        cwd = shell::word(&farm.cwd),
        program = shell::word(&farm.program),
        merge = farm.merge(),
    );
    let submit = code!(
        Shell,
        "#!/bin/sh\n\
         # Submits the array and the merge that waits for it; arguments go to both sbatch commands.\n\
         set -eu\n\
         cd {folder}\n\
         array=$(sbatch --parsable \"$@\" render.sbatch)\n\
         array=${{array%%;*}}\n\
         merge=$(sbatch --parsable --dependency=afterany:\"$array\" \"$@\" merge.sbatch)\n\
         echo \"array $array, merge ${{merge%%;*}}\"\n",
        folder = shell::word(&farm.folder)
    );
    let files = vec![
        File::script("render.sbatch", render),
        File::script("merge.sbatch", merge),
        File::script("submit.sh", submit),
    ];
    Submission { files, command: code!(Shell, "sh {submit}", submit = farm.file("submit.sh")) }
}
