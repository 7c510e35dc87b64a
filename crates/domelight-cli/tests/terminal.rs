//! The first minutes at a terminal: no arguments, misspelled names, completions, manual pages.

use crate::common;

use std::fs;
use std::process::Command;

use common::{domelight, done, ended, json, stderr};
use tempfile::TempDir;

const SHELLS: [&str; 5] = ["bash", "elvish", "fish", "powershell", "zsh"];

fn folder() -> TempDir {
    TempDir::new().expect("a temporary folder")
}

#[test]
fn the_program_alone_shows_things_to_do() {
    let output = domelight(&folder(), &[]);
    ended(&output, 2, &["Five things to try", "domelight compare", "domelight --help"]);
    assert!(stderr(&output).lines().count() < 20, "{}", stderr(&output));
}

#[test]
fn a_misspelled_name_is_answered_by_the_one_that_was_meant() {
    let folder = folder();
    let render = |arguments: &[&str]| domelight(&folder, &[&["render"], arguments].concat());
    ended(&render(&["statu"]), 2, &["did you mean 'statue'?"]);
    ended(&render(&["--env", "cathedrel"]), 2, &["did you mean 'cathedral'?"]);
    ended(&render(&["--strategy", "enviroment"]), 2, &["a similar value exists: 'environment'"]);
    ended(&render(&["--material", "beckman:0.1"]), 2, &["a similar value exists: 'beckmann'"]);
    ended(&render(&["--exposre", "1"]), 2, &["a similar argument exists: '--exposure'"]);
    ended(&domelight(&folder, &["rendr"]), 2, &["a similar subcommand exists: 'render'"]);
    // A file is no misspelled name.
    let output = render(&["models/statu.ply"]);
    assert!(!stderr(&output).contains("did you mean"), "{}", stderr(&output));
}

#[test]
fn a_report_of_a_problem_says_what_runs_where() {
    let folder = folder();
    let path = folder.path().join("bin");
    fs::create_dir(&path).unwrap();
    let run = || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_domelight"));
        command.arg("doctor").env("PATH", &path).env("OIDN_LIBRARY", "nothing-of-this-name");
        command.output().expect("the program starts")
    };
    let output = run();
    let text = done(&output);
    assert!(text.starts_with(concat!("domelight ", env!("CARGO_PKG_VERSION"), "\n")), "{text}");
    for line in ["threads       ", "memory limit  ", "cache         ", "denoiser      no denoiser"]
    {
        assert!(text.contains(&format!("\n{line}")), "{text}");
    }
    assert!(text.contains("\nBlender       no program"), "{text}");
    let program = path.join(format!("blender{}", std::env::consts::EXE_SUFFIX));
    fs::write(&program, "").unwrap();
    assert!(done(&run()).contains(&format!("\nBlender       {}\n", program.display())));
    let report = json(&domelight(&folder, &["doctor", "--json"]));
    assert!(report["instruction_sets"].as_array().unwrap().contains(&"scalar".into()), "{report}");
}

#[test]
fn each_shell_gets_a_script_that_knows_commands_and_options() {
    let folder = folder();
    for shell in SHELLS {
        let output = domelight(&folder, &["completions", shell]);
        let script = done(&output);
        for word in ["render", "inspect", "spp"] {
            assert!(script.contains(word), "{shell} lacks {word}");
        }
        let output = domelight(&folder, &["completions", shell, "--json"]);
        assert_eq!(json(&output)["script"], script);
        assert_eq!(json(&output)["shell"], shell);
    }
    ended(&domelight(&folder, &["completions", "zhs"]), 2, &["zsh"]);
}

#[test]
#[cfg(unix)]
fn bash_completes_a_command() {
    let folder = folder();
    let script = domelight(&folder, &["completions", "bash"]).stdout;
    fs::write(folder.path().join("domelight.bash"), script).unwrap();
    let ask = "source ./domelight.bash; COMP_WORDS=(domelight ins); COMP_CWORD=1; \
               _domelight domelight ins domelight; echo \"${COMPREPLY[*]}\"";
    let Ok(output) = Command::new("bash").args(["-c", ask]).current_dir(&folder).output() else {
        eprintln!("not tested: there is no bash");
        return;
    };
    assert_eq!(String::from_utf8_lossy(&output.stdout).trim(), "inspect");
}

#[test]
fn manual_pages_say_what_help_says() {
    let folder = folder();
    let output = domelight(&folder, &["man", "pages", "--json"]);
    let report = json(&output);
    let files: Vec<&str> =
        report["files"].as_array().unwrap().iter().map(|file| file.as_str().unwrap()).collect();
    assert!(files.contains(&"pages/domelight.1"), "{files:?}");
    assert!(files.contains(&"pages/domelight-render.1"), "{files:?}");
    for file in files {
        let page = fs::read_to_string(folder.path().join(file)).expect(file);
        assert!(page.contains(".TH"), "{file}");
        for section in ["NAME", "SYNOPSIS", "DESCRIPTION"] {
            assert!(page.contains(&format!(".SH {section}")), "{file} lacks {section}");
        }
    }
    let page = fs::read_to_string(folder.path().join("pages/domelight-render.1")).unwrap();
    assert!(page.contains("Examples"), "{page}");
    let again = domelight(&folder, &["man", "pages"]);
    ended(&again, 0, &["pages in pages", "man -l pages/domelight.1"]);
}
