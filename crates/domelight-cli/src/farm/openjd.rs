//! Open Job Description: a job template for Deadline Cloud and others.

use super::{Farm, File, Submission, text};
use crate::shell::quote;

/// `job.yaml`. A default of a path must be relative to the template's folder, so that what lies elsewhere is given
/// on the command line.
pub(super) fn submission(farm: &Farm) -> Submission {
    let Farm { program, cwd, render, n_shards, threads, name, .. } = farm;
    let template = format!(
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
          args: ["{{{{Task.File.Run}}}}"]
          # A shard that is run again goes on with its part.
          cancelation: {{ mode: NOTIFY_THEN_TERMINATE, notifyPeriodInSeconds: 30 }}
      embeddedFiles:
        - name: Run
          type: TEXT
          data: |
            set -eu
            cd '{{{{Param.WorkDir}}}}'
            mkdir -p '{{{{Param.PartsDir}}}}'
            k=$(( {{{{Task.Param.Shard}}}} - 1 ))
            exec '{{{{Param.Program}}}}' render {render} --shard "$k/{{{{Param.Shards}}}}" --threads {threads} --progress openjd -o '{{{{Param.PartsDir}}}}'/part-"$k".exr
    hostRequirements:
      amounts: [{{ name: amount.worker.vcpu, min: {threads} }}]
  - name: Merge
    dependencies: [{{ dependsOn: Render }}]
    script:
      actions:
        onRun: {{ command: sh, args: ["{{{{Task.File.Run}}}}"] }}
      embeddedFiles:
        - name: Run
          type: TEXT
          data: |
            set -eu
            exec '{{{{Param.Program}}}}' merge '{{{{Param.PartsDir}}}}' -o '{{{{Param.Picture}}}}'
"#,
        program = serde_json::Value::from(program.as_str()),
    );
    let job = quote(&text(&farm.folder.join("job.yaml")));
    let mut command = format!("openjd run {job} -p {}", quote(&format!("WorkDir={cwd}")));
    if farm.picture != farm.folder.join("picture.exr") {
        let picture = format!("Picture={}", text(&farm.picture));
        command = format!("{command} -p {}", quote(&picture));
    }
    Submission { files: vec![File { name: "job.yaml", text: template }], command }
}
