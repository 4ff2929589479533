//! Two examples for every command's help. They are parsed by the tests, so that they cannot go
//! stale.

use clap::Command;

/// Per command its examples, one a line.
pub(crate) const EXAMPLES: [(&str, [&str; 2]); 29] = [
    (
        "demo",
        ["jointwatch demo", "jointwatch demo --out story --seed 4"],
    ),
    (
        "capture",
        [
            "jointwatch capture --port /dev/ttyACM0",
            "jointwatch capture --port COM3 -o alarm.bin",
        ],
    ),
    (
        "study-from",
        [
            "jointwatch study-from capture.bin --rig rig.bin -o now",
            "jointwatch study-from frames.bin --rig rig.bin --model model.bin -o now",
        ],
    ),
    (
        "lab",
        [
            "jointwatch lab study.toml model.json",
            "jointwatch lab run1.csv run2.csv --open",
        ],
    ),
    (
        "simulate",
        [
            "jointwatch simulate --out rig --axes 1",
            "jointwatch simulate --out rig --hidden jenkins@x --share 0.2",
        ],
    ),
    (
        "init",
        [
            "jointwatch init run1.csv run2.csv check.csv",
            "jointwatch init run1.mat --yes --column force=vir --rate 1000",
        ],
    ),
    (
        "identify",
        [
            "jointwatch identify study.toml --model physical",
            "jointwatch identify rig --model network -o net.json",
        ],
    ),
    (
        "accumulate",
        [
            "jointwatch accumulate study.toml",
            "jointwatch accumulate study.toml july/1.parquet july/2.parquet -o july.acc",
        ],
    ),
    (
        "select",
        [
            "jointwatch select study.toml july/1.parquet july/2.parquet --segments 60",
            "jointwatch select study.toml june july -o summer",
        ],
    ),
    (
        "merge",
        [
            "jointwatch merge june.acc july.acc",
            "jointwatch merge june.acc july.acc august.acc -o summer.acc",
        ],
    ),
    (
        "compare",
        [
            "jointwatch compare study.toml model.json",
            "jointwatch compare rig model.json --report page.html",
        ],
    ),
    (
        "diagnose",
        [
            "jointwatch diagnose study.toml model.json",
            "jointwatch diagnose rig model.json --apply -o better.json",
        ],
    ),
    (
        "changed",
        [
            "jointwatch changed model.json may.toml",
            "jointwatch changed old.json may.toml new.json --json changed.json",
        ],
    ),
    (
        "add",
        [
            "jointwatch add study.toml model.json coulomb@x",
            "jointwatch add rig model.json jenkins@x maxwell@x -o better.json",
        ],
    ),
    (
        "effects",
        ["jointwatch effects", "jointwatch effects bouc_wen"],
    ),
    (
        "export",
        [
            "jointwatch export model.json -o model.bin",
            "jointwatch export model.json --rig rig.toml --study study.toml -o rig.bin",
        ],
    ),
    (
        "inspect",
        [
            "jointwatch inspect run1.tdms",
            "jointwatch inspect model.bin --json -",
        ],
    ),
    (
        "replay",
        [
            "jointwatch replay model.bin study.toml",
            "jointwatch replay model.bin study.toml --rig rig.bin --monitor",
        ],
    ),
    (
        "emulate",
        [
            "jointwatch emulate model.bin study.toml",
            "jointwatch emulate model.bin rig --serve 4000 --change force@x*0.7",
        ],
    ),
    (
        "monitor",
        [
            "jointwatch monitor --port /dev/ttyUSB0 --record frames.bin",
            "jointwatch monitor --tcp 127.0.0.1:4000",
        ],
    ),
    (
        "respond",
        [
            "jointwatch respond study.toml model.json",
            "jointwatch respond rig model.json --record valid.csv",
        ],
    ),
    (
        "paper",
        [
            "jointwatch paper --out page",
            "jointwatch paper --out page --quiet",
        ],
    ),
    (
        "keygen",
        [
            "jointwatch keygen -o workshop.key",
            "jointwatch keygen -o lab/rig4.key",
        ],
    ),
    (
        "order",
        [
            "jointwatch order acknowledge --port /dev/ttyUSB0 --key line7",
            "jointwatch order roll-back --port COM3 --development-key",
        ],
    ),
    (
        "sign",
        [
            "jointwatch sign model.bin --rig rig.bin --key workshop.key -o signed.bin",
            "jointwatch sign model.bin --rig rig.bin --development-key -o signed.bin",
        ],
    ),
    (
        "upload",
        [
            "jointwatch upload signed.bin --port /dev/ttyUSB0",
            "jointwatch upload signed.bin --port COM4",
        ],
    ),
    ("study", ["jointwatch study", "jointwatch study --schema"]),
    (
        "completions",
        ["jointwatch completions bash", "jointwatch completions zsh"],
    ),
    (
        "manual",
        [
            "jointwatch manual -o man1",
            "jointwatch manual --output share/man/man1",
        ],
    ),
];

/// The whole command line, with examples in every command's help.
pub(crate) fn with_examples(mut command: Command) -> Command {
    for (name, lines) in EXAMPLES {
        let words = format!("Examples:\n  {}\n  {}", lines[0], lines[1]);
        command = command.mut_subcommand(name, |sub| sub.after_help(words));
    }
    command
}
