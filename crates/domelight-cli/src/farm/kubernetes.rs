//! Kubernetes: an Indexed Job, and a Job that merges.

use domelight::code;
use domelight::quote::{Code, Shell, Yaml, shell, yaml};

use super::{Farm, File, Submission};

/// `render.yaml` and `merge.yaml`: scene and parts lie on the volume claim `domelight`, mounted at `/work`.
pub(super) fn submission(farm: &Farm) -> Submission {
    let Farm { render, n_shards, threads, name, .. } = farm;
    let job = |name: &str, spec: &Code<Yaml>, command: &Code<Shell>, cpus: u32| {
        code!(
            Yaml,
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
"#,
            name = yaml::string(name),
            spec = spec,
            image = yaml::string(&farm.image),
            command = yaml::kubernetes_argument(command.as_str()),
            cpus = cpus,
        )
    };
    let spec = code!(
        Yaml,
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
        onPodConditions: [{{ type: DisruptionTarget }}]",
        n_shards = *n_shards,
    );
    let parts = shell::word(&format!("{name}-parts"));
    let shard = code!(
        Shell,
        "mkdir -p {parts} && exec domelight render --shard $JOB_COMPLETION_INDEX/{n_shards} --threads {threads} --quiet \
         -o {parts}/part-$JOB_COMPLETION_INDEX.exr {render}",
        parts = parts,
        n_shards = *n_shards,
        threads = *threads,
        render = render,
    );
    let picture = farm.volume_picture.clone().unwrap_or_else(|| format!("{name}.exr"));
    let merge = code!(
        Shell,
        "exec domelight merge {parts} -o {picture}{options}",
        parts = parts,
        picture = shell::word(&picture),
        options = farm.merge_options,
    );
    let merge_spec = Code::literal("  backoffLimit: 3");
    let files = vec![
        File::template("render.yaml", job(name, &spec, &shard, *threads)),
        File::template("merge.yaml", job(&format!("{name}-merge"), &merge_spec, &merge, 1)),
    ];
    let command = code!(
        Shell,
        "kubectl apply -f {render} && kubectl wait --for=condition=complete --timeout=-1s {job} && kubectl apply -f {merge}",
        render = farm.file("render.yaml"),
        job = shell::word(&format!("job/{name}")),
        merge = farm.file("merge.yaml"),
    );
    Submission { files, command }
}
