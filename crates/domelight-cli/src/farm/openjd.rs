//! Open Job Description: a job template for Deadline Cloud and others.
//!
//! What stands in double braces is replaced wherever it stands, also within the quotes of a script. So scripts get
//! values as arguments, and what they hold of names has no two braces side by side ([`shell::word`]).

use domelight::code;
use domelight::quote::{Shell, Yaml, shell, yaml};

use super::{Farm, File, Submission};

/// The column of the scripts in the template.
const SCRIPT: usize = 12;

/// `job.yaml`. A default of a path must be relative to the template's folder, so that what lies elsewhere is given
/// on the command line.
pub(super) fn submission(farm: &Farm) -> Submission {
    let render = code!(
        Shell,
        "set -eu\n\
         program=$1 work=$2 parts=$3 shard=$4 shards=$5\n\
         cd \"$work\"\n\
         mkdir -p \"$parts\"\n\
         k=$((shard - 1))\n\
         exec \"$program\" render --shard \"$k/$shards\" --threads {threads} --progress openjd -o \"$parts/part-$k.exr\" {render}\n",
        threads = farm.threads,
        render = farm.render,
    );
    let merge = code!(
        Shell,
        "set -eu\nexec \"$1\" merge -o \"$3\"{options} -- \"$2\"\n",
        options = farm.merge_options,
    );
    let template = code!(
        Yaml,
        r#"specificationVersion: jobtemplate-2023-09
name: {name}
parameterDefinitions:
  - {{ name: Program, type: STRING, default: {program}, description: The domelight program on the workers }}
  - {{ name: WorkDir, type: PATH, objectType: DIRECTORY, dataFlow: IN, description: Where relative names start }}
  - {{ name: PartsDir, type: PATH, objectType: DIRECTORY, dataFlow: INOUT, default: parts }}
  - {{ name: Picture, type: PATH, objectType: FILE, dataFlow: OUT, default: picture.exr }}
  - {{ name: Shards, type: INT, default: {n_shards}, minValue: 1, maxValue: 100000 }}
steps:
  - name: Render
    parameterSpace:
      taskParameterDefinitions:
        - {{ name: Shard, type: INT, range: "1-{{{{Param.Shards}}}}" }}
    script:
      actions:
        onRun:
          command: sh
          args:
            - "{{{{Task.File.Run}}}}"
            - "{{{{Param.Program}}}}"
            - "{{{{Param.WorkDir}}}}"
            - "{{{{Param.PartsDir}}}}"
            - "{{{{Task.Param.Shard}}}}"
            - "{{{{Param.Shards}}}}"
          # A shard that is run again goes on with its part.
          cancelation: {{ mode: NOTIFY_THEN_TERMINATE, notifyPeriodInSeconds: 30 }}
      embeddedFiles:
        - name: Run
          type: TEXT
          data: {render}
    hostRequirements:
      amounts: [{{ name: amount.worker.vcpu, min: {threads} }}]
  - name: Merge
    dependencies: [{{ dependsOn: Render }}]
    script:
      actions:
        onRun:
          command: sh
          args: ["{{{{Task.File.Run}}}}", "{{{{Param.Program}}}}", "{{{{Param.PartsDir}}}}", "{{{{Param.Picture}}}}"]
      embeddedFiles:
        - name: Run
          type: TEXT
          data: {merge}
"#,
        name = yaml::string(&farm.name),
        program = yaml::string(&farm.program),
        n_shards = farm.n_shards,
        threads = farm.threads,
        render = yaml::script(&render, SCRIPT),
        merge = yaml::script(&merge, SCRIPT),
    );
    let mut command = code!(
        Shell,
        "openjd run {job} -p {work}",
        job = farm.file("job.yaml"),
        work = shell::word(&format!("WorkDir={}", farm.cwd)),
    );
    if farm.picture != farm.path("picture.exr") {
        let picture = format!("Picture={}", farm.picture);
        command += code!(Shell, " -p {picture}", picture = shell::word(&picture));
    }
    Submission { files: vec![File::template("job.yaml", template)], command }
}
