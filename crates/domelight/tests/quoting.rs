//! Foreign text in other languages, read back by their own parsers.
//!
//! A program that is not there is passed over with a message; where CI is true it must be there.
#![cfg(feature = "io")]

use std::fmt::Write as _;
use std::io::Write as _;
use std::process::{Command, Stdio};

use domelight::code;
use domelight::environment::{Environment, Orientation};
use domelight::math::Vec3;
use domelight::quote::{
    Code, Html, JavaScript, Python, Shell, Xml, html, javascript, pbrt, python, radiance, shell,
    sibl, usd, xml, yaml,
};
use domelight::rig::export::{Dome, Format, RigExport};
use domelight::rig::{Region, RigLight, SphericalHarmonics};
use domelight::{Rgb, RgbImage};
use testkit::Pcg;

/// What has a meaning somewhere.
const PIECES: [&str; 56] = [
    "a",
    "B",
    "0",
    " ",
    "  ",
    "\"",
    "'",
    "`",
    "\\",
    "\\n",
    "\\u2028",
    "$",
    "$(exit 7)",
    "${x}",
    "$$",
    "$(x",
    "`exit 7`",
    ";",
    "&&",
    "|",
    "&",
    "<",
    ">",
    "</script>",
    "<!--",
    "-->",
    "--",
    "]]>",
    "{{Param.X}}",
    "{{",
    "}}",
    "{",
    "}",
    "#",
    "//",
    "*/",
    "@",
    "@@@",
    "%",
    "!",
    "~",
    "-",
    "- ",
    ": ",
    "\n",
    "\r\n",
    "\r",
    "\t",
    "\u{7f}",
    "\u{85}",
    "\u{2028}",
    "\u{2029}",
    "\u{feff}",
    "\u{ffff}",
    "é\u{1b}[31m\u{202e}",
    "🌞\u{1}",
];

/// Each piece alone, and random rows of them.
fn texts() -> Vec<String> {
    let mut rng = Pcg::new(20);
    let mut texts: Vec<String> = PIECES.map(str::to_owned).to_vec();
    texts.push(String::new());
    texts.push("coding: utf-7 +AGkAbQBwAG8AcgB0-".into());
    texts.extend((0..400).map(|_| {
        let n = 1 + (rng.next_f64() * 12.0) as usize;
        (0..n).map(|_| PIECES[(rng.next_f64() * PIECES.len() as f64) as usize]).collect::<String>()
    }));
    texts
}

/// What the program says when it is given `input`; none if it is not installed.
fn run(program: &str, arguments: &[&str], input: &str) -> Option<Vec<u8>> {
    let child = Command::new(program)
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    let Ok(mut child) = child else {
        assert!(std::env::var("CI").as_deref() != Ok("true"), "{program} is not installed");
        println!("{program} is not installed: passed over");
        return None;
    };
    let mut stdin = child.stdin.take().unwrap();
    let input = input.to_owned();
    let writer = std::thread::spawn(move || drop(stdin.write_all(input.as_bytes())));
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    assert!(output.status.success(), "{program}: {}", String::from_utf8_lossy(&output.stderr));
    Some(output.stdout)
}

fn hex(text: &str) -> String {
    text.bytes().fold(String::new(), |mut hex, byte| {
        let _ = write!(hex, "{byte:02x}");
        hex
    })
}

#[track_caller]
fn assert_read(read: Option<Vec<u8>>, texts: &[String]) {
    let Some(read) = read else { return };
    let read = String::from_utf8(read).unwrap();
    let expected: Vec<String> = texts.iter().map(|text| hex(text)).collect();
    let read: Vec<&str> = read.strip_suffix('\n').unwrap_or(&read).split('\n').collect();
    assert_eq!(read.len(), expected.len());
    for ((read, expected), text) in read.iter().zip(&expected).zip(texts) {
        assert_eq!(read, expected, "{text:?}");
    }
}

#[test]
fn a_shell_reads_words() {
    let texts: Vec<String> = texts();
    let mut script = Code::<Shell>::default();
    for text in &texts {
        let word = shell::word(text);
        assert!(!word.as_str().contains("{{") && !word.as_str().contains("}}"), "{word}");
        script += code!(Shell, "printf %s {word}; printf '\\0'\n", word = word);
    }
    let Some(read) = run("sh", &["-s"], script.as_str()) else { return };
    let expected: Vec<u8> = texts.iter().flat_map(|t| [t.as_bytes(), &[0]].concat()).collect();
    assert!(read == expected, "{}", String::from_utf8_lossy(&read));
}

#[test]
fn node_reads_strings_and_passes_over_comments() {
    let texts = texts();
    let mut script = Code::<JavaScript>::default();
    for text in &texts {
        script += code!(
            JavaScript,
            "// {comment}\nconsole.log(Buffer.from({text}).toString('hex'));\n",
            comment = javascript::comment(text),
            text = javascript::string(text),
        );
    }
    assert_read(run("node", &["--input-type=module", "-"], script.as_str()), &texts);
}

#[test]
fn python_reads_strings_and_passes_over_comments() {
    let texts = texts();
    let mut script = Code::<Python>::literal("# -*- coding: utf-8 -*-\nimport sys\n");
    for text in &texts {
        script += code!(
            Python,
            "# {comment}\nsys.stdout.write({text}.encode('utf-8').hex() + '\\n')\n",
            comment = python::comment(text),
            text = python::string(text),
        );
    }
    assert_read(run("python3", &["-"], script.as_str()), &texts);
}

/// Rigs of a dome and one light, of probes and files of these names.
fn rigs(format: Format, texts: &[String]) -> Vec<String> {
    let map = RgbImage::filled(4, 2, Rgb::WHITE);
    let environment = Environment::from_image(map).unwrap();
    let harmonics = SphericalHarmonics::project(&environment);
    let lights = [RigLight {
        direction: Vec3::Y,
        irradiance: Rgb::WHITE,
        angular_radius: 0.1,
        share: 0.5,
        solid_angle: 0.03,
        region: Region::Sun,
    }];
    let rig = |text: &String| {
        let file = format!("{text}.exr");
        let dome = Some(Dome { environment: &environment, harmonics, file: Some(&file) });
        let orientation = Orientation::default();
        let rig = RigExport { probe: text, orientation, lights: &lights, dome };
        String::from_utf8(format.encode(&rig).unwrap()).unwrap()
    };
    texts.iter().map(rig).collect()
}

#[test]
fn a_rig_for_blender_is_the_same_python_whatever_the_probe_is_called() {
    const READER: &str = "
import ast, json, sys
trees = [ast.parse(script) for script in json.loads(sys.stdin.read())]
shapes = {tuple(type(node).__name__ for node in ast.walk(tree)) for tree in trees}
assert len(shapes) == 1, shapes
print(len(trees))
";
    let scripts = rigs(Format::Blender, &texts());
    let read = run("python3", &["-c", READER], &serde_json::to_string(&scripts).unwrap());
    let Some(read) = read else { return };
    assert_eq!(String::from_utf8(read).unwrap().trim(), scripts.len().to_string());
}

#[test]
fn a_rig_for_three_js_is_a_module_whatever_the_probe_is_called() {
    const READER: &str = "
const { SourceTextModule } = require('vm');
const scripts = JSON.parse(require('fs').readFileSync(0, 'utf8'));
for (const script of scripts) new SourceTextModule(script);
console.log(scripts.length);
";
    let scripts = rigs(Format::Three, &texts());
    let arguments = ["--no-warnings", "--experimental-vm-modules", "-e", READER];
    let read = run("node", &arguments, &serde_json::to_string(&scripts).unwrap());
    let Some(read) = read else { return };
    assert_eq!(String::from_utf8(read).unwrap().trim(), scripts.len().to_string());
}

#[test]
fn an_html_parser_reads_text_attributes_and_data() {
    const READER: &str = "
import html.parser, json, sys
class Reader(html.parser.HTMLParser):
    def __init__(self):
        super().__init__()
        self.text = ''
    def handle_starttag(self, tag, attributes):
        self.text = ''
        if tag == 'p':
            self.title = dict(attributes)['title']
    def handle_data(self, data):
        self.text += data
    def handle_endtag(self, tag):
        if tag == 'p':
            assert self.text == self.title, (self.text, self.title)
            print(self.text.encode('utf-8').hex())
        elif tag == 'script':
            assert json.loads(self.text) == self.title
reader = Reader()
reader.feed(open(sys.argv[1], encoding='utf-8', newline='').read())
";
    let texts: Vec<String> = texts().into_iter().filter(|text| xml::holds(text)).collect();
    let mut page = Code::<Html>::literal("<!DOCTYPE html><meta charset=\"utf-8\">");
    for text in &texts {
        page += code!(
            Html,
            "<p title=\"{text}\">{text}</p><script type=\"application/json\">{data}</script>\n",
            text = html::text(text),
            data = html::script_data(&text.as_str().into()),
        );
    }
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("page.html");
    std::fs::write(&file, page.as_str()).unwrap();
    let read = run("python3", &["-c", READER, &file.to_string_lossy()], "");
    // Marks of writing direction are shown.
    let shown: Vec<String> = texts.iter().map(|t| t.replace('\u{202e}', "\\u{202e}")).collect();
    assert_read(read, &shown);
}

#[test]
fn an_xml_reader_reads_text_attributes_and_comments() {
    for text in texts() {
        let file = code!(
            Xml,
            "<?xml version=\"1.0\"?>\n<!-- {comment} --><a b=\"{text}\">{text}</a>",
            comment = xml::comment(&text),
            text = xml::text(&text),
        );
        let document =
            roxmltree::Document::parse(file.as_str()).unwrap_or_else(|e| panic!("{e}: {text:?}"));
        let root = document.root_element();
        let read = (root.attribute("b"), root.text().unwrap_or_default());
        assert_eq!(document.root().children().count(), 2);
        if xml::holds(&text) {
            assert_eq!(read, (Some(&*text), &*text));
        }
    }
}

#[test]
fn a_yaml_reader_reads_strings_and_scripts() {
    let read = |file: &str| {
        let documents = yaml_rust2::YamlLoader::load_from_str(file);
        documents.unwrap_or_else(|e| panic!("{e}: {file:?}"))[0].clone()
    };
    for text in texts() {
        let string = yaml::string(&text);
        let file = read(&format!("a:\n  - {{ key: {string}, next: 1 }}\n"));
        assert_eq!(file["a"][0]["key"].as_str(), Some(&*text));
        assert_eq!(serde_json::from_str::<String>(string.as_str()).unwrap(), text);

        let script = code!(Shell, "set -eu\n\nexec {word}\n", word = shell::word(&text));
        let block = yaml::script(&script, 8);
        let file = read(&format!("a:\n    - data: {block}\n    - next: 1\n"));
        assert_eq!(file["a"][0]["data"].as_str(), Some(script.as_str()), "{text:?}");
        assert_eq!(file["a"][1]["next"].as_i64(), Some(1));
    }
}

/// Kubernetes replaces `$(NAME)`, and takes two dollars for one.
#[test]
fn kubernetes_expands_arguments_to_what_they_were() {
    fn expand(text: &str) -> String {
        let (mut expanded, mut rest) = (String::new(), text);
        while let Some((before, after)) = rest.split_once('$') {
            expanded += before;
            rest = match after.chars().next() {
                Some('$') => {
                    expanded.push('$');
                    &after[1..]
                }
                Some('(') => panic!("a reference to a variable in {text:?}"),
                _ => {
                    expanded.push('$');
                    after
                }
            };
        }
        expanded + rest
    }
    for text in texts() {
        let string: String =
            serde_json::from_str(yaml::kubernetes_argument(&text).as_str()).unwrap();
        assert_eq!(expand(&string), text);
    }
}

/// Grammars without a parser at hand, by what their manuals say.
#[test]
fn quotes_of_scenes_end_where_they_should() {
    for text in texts() {
        for comment in [pbrt::comment(&text).into_string(), radiance::comment(&text).into_string()]
        {
            assert!(!comment.contains(char::is_control));
        }
        let caption = sibl::caption(&text);
        assert_eq!(caption.as_str().matches('"').count(), 2);
        assert!(!caption.as_str().contains(char::is_control));
        assert!(
            sibl::value(&text)
                .is_none_or(|value| value.as_str()[1..].find('"') == Some(text.len()))
        );
        if let Some(word) = radiance::word(&text) {
            let quote = word.as_str().chars().next().unwrap();
            assert_eq!(word.as_str()[1..].find(quote), Some(text.len()), "{text:?}");
        }
        if let Some(string) = pbrt::string(&text) {
            assert_eq!(unescaped(string.as_str(), "nrt\"\\"), text);
        }
        assert_eq!(unescaped(usd::string(&text).as_str(), "nrt\"\\x"), text);
        if let Some(asset) = usd::asset(&text) {
            let triple = asset.as_str().strip_prefix("@@@").and_then(|a| a.strip_suffix("@@@"));
            let read = match triple {
                Some(inside) => inside.replace("\\@@@", "@@@"),
                None => asset.as_str().trim_matches('@').to_owned(),
            };
            assert_eq!(read, text);
            assert_eq!(triple.is_some(), text.contains('@'));
        }
    }
}

/// The text of a string in double quotes, whose escapes are some of these.
fn unescaped(quoted: &str, escapes: &str) -> String {
    let mut chars = quoted.strip_prefix('"').unwrap().chars();
    let mut text = String::new();
    loop {
        let c = chars.next().unwrap();
        assert!(!matches!(c, '\n' | '\r'));
        match c {
            '"' => break,
            '\\' => {
                let escape = chars.next().unwrap();
                assert!(escapes.contains(escape));
                text.push(match escape {
                    'n' => '\n',
                    'r' => '\r',
                    't' => '\t',
                    'x' => {
                        let digits: String = chars.by_ref().take(2).collect();
                        char::from(u8::from_str_radix(&digits, 16).unwrap())
                    }
                    c => c,
                });
            }
            c => text.push(c),
        }
    }
    assert_eq!(chars.next(), None);
    text
}
