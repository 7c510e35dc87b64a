//! Kubernetes: an Indexed Job, and a Job that merges.

use super::{Farm, File, Submission, text};
use crate::shell::quote;

/// `render.yaml` and `merge.yaml`: scene and parts lie on the volume claim `domelight`, mounted at `/work`.
pub(super) fn submission(farm: &Farm) -> Submission {
    let Farm { render, n_shards, threads, name, image, .. } = farm;
    let image = serde_json::Value::from(image.as_str()).to_string();
    let job = |name: &str, spec: &str, command: &str, cpus: u32| {
        let command = serde_json::Value::from(command).to_string();
        format!(
            r#"apiVersion: batch/v1
kind: Job
metadata: {{ name: {name} }}
spec:
{spec}
  template:
    spec:
      restartPolicy: Never
      # SIGTERM saves the part and exits with 75; the pod's successor goes on with it.
      terminationGracePeriodSeconds: 30
      containers:
        - name: domelight
          image: {image}
          workingDir: /work
          command: ["sh", "-c", {command}]
          resources: {{ requests: {{ cpu: "{cpus}" }}, limits: {{ cpu: "{cpus}" }} }}
          volumeMounts: [{{ name: work, mountPath: /work }}]
      volumes: [{{ name: work, persistentVolumeClaim: {{ claimName: domelight }} }}]
"#
        )
    };
    let spec = format!(
        "  completions: {n_shards}
  parallelism: {n_shards}
  completionMode: Indexed
  backoffLimitPerIndex: 6
  maxFailedIndexes: 0
  podFailurePolicy:
    rules:
      - action: FailIndex # 2: the arguments or the scene are wrong, trying again cannot help
        onExitCodes: {{ containerName: domelight, operator: In, values: [2] }}
      - action: Ignore # 75: interrupted and saved, no failure
        onExitCodes: {{ containerName: domelight, operator: In, values: [75] }}
      - action: Ignore # evicted or drained: no failure
        onPodConditions: [{{ type: DisruptionTarget }}]"
    );
    let shard = format!(
        "mkdir -p {name}-parts && exec domelight render {render} --shard $JOB_COMPLETION_INDEX/{n_shards} --threads {threads} --quiet -o {name}-parts/part-$JOB_COMPLETION_INDEX.exr"
    );
    let merge = format!("exec domelight merge {name}-parts -o {name}.exr");
    let files = vec![
        File { name: "render.yaml", text: job(name, &spec, &shard, *threads) },
        File {
            name: "merge.yaml",
            text: job(&format!("{name}-merge"), "  backoffLimit: 3", &merge, 1),
        },
    ];
    let file = |name: &str| quote(&text(&farm.folder.join(name)));
    let command = format!(
        "kubectl apply -f {} && kubectl wait --for=condition=complete --timeout=-1s job/{name} && kubectl apply -f {}",
        file("render.yaml"),
        file("merge.yaml")
    );
    Submission { files, command }
}
