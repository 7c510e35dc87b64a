//! Open Job Description: a job template for Deadline Cloud and others.

use super::shell::quote;
use super::{Farm, File, Submission, text};

/// `job.yaml`.
pub(super) fn submission(farm: &Farm) -> Submission {
    let Farm { program, cwd, render, n_shards, threads, name, .. } = farm;
    let string = |text: &str| serde_json::Value::from(text).to_string();
    let template = format!(
        r#"specificationVersion: jobtemplate-2023-09
name: {name}
parameterDefinitions:
  - {{ name: Program, type: STRING, default: {program}, description: The domelight program on the workers }}
  - {{ name: WorkDir, type: PATH, objectType: DIRECTORY, dataFlow: IN, default: {cwd}, description: Where relative names start }}
  - {{ name: PartsDir, type: PATH, objectType: DIRECTORY, dataFlow: INOUT, default: {parts} }}
  - {{ name: Picture, type: PATH, objectType: FILE, dataFlow: OUT, default: {picture} }}
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
        program = string(program),
        cwd = string(cwd),
        parts = string(&text(&farm.parts())),
        picture = string(&text(&farm.picture)),
    );
    let command = format!("openjd run {}", quote(&text(&farm.folder.join("job.yaml"))));
    Submission { files: vec![File { name: "job.yaml", text: template }], command }
}
