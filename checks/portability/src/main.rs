//! Prints the checksums, with the fastest instructions or those that are named: scalar, neon, avx2, avx512. Where the
//! processor lacks them the exit code is 3.

use domelight::bvh::InstructionSet;

fn main() {
    let mut set = InstructionSet::best();
    if let Some(name) = std::env::args().nth(1) {
        let named = |set: &InstructionSet| format!("{set:?}").eq_ignore_ascii_case(&name);
        set = InstructionSet::ALL.into_iter().find(named).expect("an instruction set");
    }
    if !set.is_available() {
        std::process::exit(3);
    }
    print!("{}", portability::report(set));
}
