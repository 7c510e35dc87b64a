//! Prints the checksums.

fn main() {
    print!("{}", portability::report());
}
