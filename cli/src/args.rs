//! What was typed.

mod correct;
mod paper;
mod pictures;

use std::path::PathBuf;

use clap::{Parser, Subcommand, ValueEnum, builder::PossibleValuesParser};
use correct::CORRECT_EXAMPLES;
pub(crate) use correct::{CorrectArgs, SamplingChoice, Steps};
use paper::{COMPARE_EXAMPLES, INSPECT_EXAMPLES};
pub(crate) use paper::{CompareArgs, DevicesArgs, InspectArgs, ReproduceArgs};
pub(crate) use pictures::{DepthRange, OverlayArgs, UndistortArgs};
use truedepth::{
    board::{self, CharucoBoard, Dictionary},
    calibrate::Model,
    diagnose::{ToleranceError, Tolerances},
    recording::DefectError,
    simulate::{Device, Faults},
    wire::Detail,
};

/// Is the depth of an Apple TrueDepth recording true? And if not: what is wrong, by how much, how sure, what fixes it?
#[derive(Debug, Parser)]
#[command(
    name = "truedepth",
    version,
    propagate_version = true,
    arg_required_else_help = true,
    subcommand_required = true,
    after_help = TOP_EXAMPLES,
    after_long_help = TOP_LONG
)]
pub(crate) struct Args {
    #[command(flatten)]
    pub(crate) global: GlobalArgs,

    #[command(subcommand)]
    pub(crate) command: Command,
}

const TOP_EXAMPLES: &str = "\
Examples:
  truedepth demo                 no device, no data: simulate a faulty iPad, audit it, see the report
  truedepth audit my-recording   everything that can be known of a recording of a ChArUco board
  truedepth explain TD201        what a finding means and what to do about it";

const TOP_LONG: &str = "\
Examples:
  truedepth demo                 no device, no data: simulate a faulty iPad, audit it, see the report
  truedepth audit my-recording   everything that can be known of a recording of a ChArUco board
  truedepth explain TD201        what a finding means and what to do about it

Results go to stdout; progress, warnings and other words go to stderr.

Exit codes:
  0  ran, no fault found
  1  could not run (or not on every recording given)
  2  the command line was not understood
  3  ran, and found faults";

/// Options of every verb.
#[derive(Debug, clap::Args)]
pub(crate) struct GlobalArgs {
    /// Say nothing on stderr but warnings and errors
    #[arg(short, long, global = true, conflicts_with = "verbose", help_heading = "Global options")]
    pub(crate) quiet: bool,

    /// Say more on stderr
    #[arg(short, long, global = true, help_heading = "Global options")]
    pub(crate) verbose: bool,

    /// When to use colour
    ///
    /// `auto`: on a terminal, unless NO_COLOR is set. Colour never says anything that the words do not.
    #[arg(
        long,
        global = true,
        value_name = "WHEN",
        default_value = "auto",
        help_heading = "Global options"
    )]
    pub(crate) color: ColorChoice,

    /// Use this many threads [default: one per core]
    ///
    /// The result does not depend on it, byte for byte.
    #[arg(
        long,
        global = true,
        value_name = "N",
        value_parser = clap::value_parser!(u16).range(1..=1024),
        help_heading = "Global options"
    )]
    pub(crate) threads: Option<u16>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ColorChoice {
    Auto,
    Always,
    Never,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Find out everything that can be known of a recording of a ChArUco board
    ///
    /// Finds the board in every frame, calibrates, compares the sensor's depth with the board's under the factory's
    /// and under the measured intrinsics, and judges. Shows a summary, and leaves report.html (open it in a browser)
    /// and report.json (for programs) in a folder NAME-report here, or where -o says. An older report of truedepth in
    /// that folder is replaced; a folder with anything else in it is refused.
    ///
    /// Exits with 3 where faults were found, 0 where none, 1 where a recording could not be audited.
    #[command(after_help = AUDIT_EXAMPLES)]
    Audit(AuditArgs),

    /// Measure the camera's intrinsics, with uncertainties
    ///
    /// The part of `audit` that looks at the colour images only; depth is not read. What --json prints can be given to
    /// `audit --calibration` for recordings that cannot calibrate themselves, like a few views straight at the board.
    #[command(after_help = CALIBRATE_EXAMPLES)]
    Calibrate(CalibrateArgs),

    /// Find the ChArUco corners of images, folders and recordings
    ///
    /// Old and new board layouts are told apart from the image. Integer pixel coordinates are pixel centres; corner
    /// ids are those of OpenCV 4.6 and newer. The detector may miss a corner; it does not guess.
    #[command(after_help = DETECT_EXAMPLES)]
    Detect(DetectArgs),

    /// What the metadata alone tell: which device, how sure, which known issue; needs no board
    ///
    /// Reads no image. The device is told by its reference dimensions, focal length and principal point, compared with
    /// the published ones of arXiv:2201.10865 and your own (--devices). What it says of a known issue is an
    /// expectation, not a measurement: `audit` measures.
    ///
    /// Exits with 3 where the metadata are at fault, 0 otherwise, also where a known issue is to be expected.
    #[command(after_help = INSPECT_EXAMPLES)]
    Inspect(InspectArgs),

    /// Compare the factory parameters of one device: AVFoundation's with ARKit's, or yesterday's with today's
    ///
    /// Of different APIs: every derived column of the tables of arXiv:2201.10865, which issue the pair shows, and both
    /// corrections with their numbers. Of one API: whether the factory calibration has changed (TD205). Exits with 0.
    #[command(after_help = COMPARE_EXAMPLES)]
    Compare(CompareArgs),

    /// Simulate a faulty iPad, audit it, and show truth beside findings; needs no device and no data
    ///
    /// Renders a recording of an iPad whose metadata state a focal length 6.6 % too long and whose depth is 1.5 % too
    /// long, audits it as if nothing were known of it, and leaves the report in ./truedepth-demo. Exits with 3: the
    /// faults are found.
    #[command(after_help = DEMO_EXAMPLES)]
    Demo(DemoArgs),

    /// Apply corrections and write a true recording, with provenance; never in place
    ///
    /// Without --with, --fault, --av or --ar it audits first and removes what the audit calls a fault. Writes the same
    /// format: images resampled at most once, metadata with all keys, every other file as it is, and provenance.json
    /// (version, hashes of the input, findings, steps with their parameters).
    ///
    /// Depth is resampled without ever blending across holes or edges. The output appears as a whole or not at all.
    ///
    /// Exits with 0, also where there was nothing to correct (then nothing is written, unless --always); with 1 where
    /// it could not.
    #[command(after_help = CORRECT_EXAMPLES)]
    Correct(CorrectArgs),

    // These say themselves, where their options are, what they do.
    Overlay(OverlayArgs),
    Undistort(UndistortArgs),
    Reproduce(ReproduceArgs),

    /// Print the board: a PDF, SVG or PNG true to scale, and the board.toml for recordings of it
    ///
    /// On the page stand the board, a ruler of 100 mm to check the scale of the print, and the board's parameters.
    /// Print at 100 % ("actual size", not "fit to page"), glue it onto something flat, measure squares, and correct
    /// board.toml where the printer has scaled. Then put board.toml into every recording.
    ///
    /// The board, unless --board says otherwise, is 10x7 squares of 24 mm with markers of 15 mm from 5X5_100. It fills
    /// A4 and fits Letter; an odd number of rows is the same in OpenCV's old and new layout; markers of 5/8 of a square
    /// are read from far, and leave enough white for the corners to be precise.
    #[command(after_help = BOARD_EXAMPLES)]
    Board(PrintArgs),

    /// Render a recording with known truth and chosen faults
    ///
    /// Writes the same files as the capture app, and truth.json with what is true of them. The same options give the
    /// same bytes.
    #[command(after_help = simulate_help())]
    Simulate(SimulateArgs),

    /// Say what a finding means and what to do about it
    ///
    /// Without a code, list them all.
    #[command(after_help = EXPLAIN_EXAMPLES)]
    Explain(ExplainArgs),

    /// Print completions for a shell
    #[command(after_help = COMPLETIONS_EXAMPLES)]
    Completions(CompletionsArgs),

    /// Print the manual page of truedepth, or of one verb
    #[command(after_help = MAN_EXAMPLES)]
    Man(ManArgs),
}

/// How to read recordings and images.
#[derive(Debug, clap::Args)]
pub(crate) struct InputArgs {
    #[command(flatten)]
    pub(crate) board: BoardArgs,

    /// Read files of any size and number
    ///
    /// For recordings you made yourself. Without it, what asks for more than an hour of recording would is refused,
    /// so that a hostile archive cannot exhaust the memory.
    #[arg(long)]
    pub(crate) trust: bool,
}

/// The board, where the recording does not tell it.
#[derive(Debug, clap::Args)]
pub(crate) struct BoardArgs {
    /// The printed board: a board.toml, or SQUARES:SQUARE:MARKER:DICTIONARY
    ///
    /// Needed where the recording brings neither a board.toml nor a checkersize.txt; given here it goes before both.
    /// In short form: squares along x and y, side of a square, side of a marker (black border included), dictionary
    /// as OpenCV names it or a file of OpenCV's form (mine.yml), and `legacy` or `new` if the layout is known (else it
    /// is found from the images), like 10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL. Lengths carry a unit (mm, cm, m, in).
    /// Measure the print: printers scale.
    #[arg(long, value_name = "FILE|SPEC", value_parser = board_argument)]
    pub(crate) board: Option<BoardArgument>,
}

/// A board as it was typed.
#[derive(Clone, Debug)]
pub(crate) enum BoardArgument {
    /// A `board.toml`.
    File(PathBuf),
    /// The short form.
    Board(CharucoBoard),
    /// The short form with a dictionary that is a file.
    WithFile(String),
}

/// Why a board in short form is none yet.
enum NotYet {
    /// Its dictionary is a file.
    File,
    /// It can never be one.
    Wrong(board::Error),
}

impl From<board::Error> for NotYet {
    fn from(error: board::Error) -> Self {
        Self::Wrong(error)
    }
}

/// The short form has colons; so have paths on Windows, but those end like a file.
fn board_argument(text: &str) -> Result<BoardArgument, board::Error> {
    if text.contains(':') && !text.ends_with(".toml") {
        // The dictionary comes last: all that stands before it is checked even where it is a file, read later.
        let board = CharucoBoard::from_short_form(text, |name| match Dictionary::is_file(name) {
            true => Err(NotYet::File),
            false => Ok(Dictionary::predefined(name)?),
        });
        return match board {
            Ok(board) => Ok(BoardArgument::Board(board)),
            Err(NotYet::File) => Ok(BoardArgument::WithFile(text.to_owned())),
            Err(NotYet::Wrong(error)) => Err(error),
        };
    }
    Ok(BoardArgument::File(PathBuf::from(text)))
}

/// How to calibrate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Method {
    /// The model that predicts held-out corners best: focal length, with Apple's table, with centre, Brown-Conrady
    Auto,
    /// As arXiv:2201.10865: one focal length, a 4 cm grid of views, all else as the factory says
    Paper,
}

/// For programs.
#[derive(Debug, clap::Args)]
pub(crate) struct JsonArgs {
    /// Print the machine-readable result on stdout, and nothing else there
    #[arg(long)]
    pub(crate) json: bool,
}

/// How much JSON says.
#[derive(Debug, clap::Args)]
pub(crate) struct DetailArgs {
    /// Say corners, residuals and poses of every frame in the JSON, too
    #[arg(long)]
    pub(crate) detail: bool,
}

impl DetailArgs {
    pub(crate) fn detail(&self) -> Detail {
        if self.detail { Detail::Frames } else { Detail::Summary }
    }
}

#[derive(Debug, clap::Args)]
pub(crate) struct AuditArgs {
    /// Recordings: folders as the capture app writes them, or zips of them
    ///
    /// A folder or zip may hold several recordings; each is audited, in order. The exit code is the worst of all.
    #[arg(required = true, value_name = "REC")]
    pub(crate) recordings: Vec<PathBuf>,

    /// Where the report goes [default: NAME-report in the current folder; none with --json]
    ///
    /// With several recordings, each gets a folder NAME-report inside.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,

    /// How to calibrate
    #[arg(long, default_value = "auto")]
    pub(crate) method: Method,

    /// Calibrate from at most so many views: of more, those that together tell most about the camera
    ///
    /// Depth is compared in all frames of these views. --method paper takes all.
    #[arg(long, value_name = "N", default_value_t = truedepth::calibrate::MAX_VIEWS, value_parser = at_least_three)]
    #[arg(conflicts_with = "calibration")]
    pub(crate) views: usize,

    #[command(flatten)]
    pub(crate) input: InputArgs,

    /// What still counts as true, like focal=0.5%; may be given several times
    #[arg(long = "tolerance", value_name = "NAME=VALUE", value_parser = tolerance, long_help = tolerance_help())]
    pub(crate) tolerances: Vec<String>,

    /// Take the camera from this file instead of calibrating
    ///
    /// The file is what `truedepth calibrate --json` printed, or the report.json of an audit. What it knows of its own
    /// errors counts in every verdict. It must be of the device that recorded: refused where the factory's
    /// focal lengths differ by more than 1.5 %.
    #[arg(long, value_name = "FILE", conflicts_with = "method")]
    pub(crate) calibration: Option<PathBuf>,

    /// Print the machine-readable result on stdout, and nothing else there
    ///
    /// One JSON document per recording. No report is written unless -o is given.
    #[arg(long)]
    pub(crate) json: bool,

    #[command(flatten)]
    pub(crate) detail: DetailArgs,

    /// Open the report in a browser
    #[arg(long)]
    pub(crate) open: bool,
}

const AUDIT_EXAMPLES: &str = "\
Examples:
  truedepth audit my-recording
  truedepth audit Archive.zip -o reports
  truedepth audit shots --board 10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL
  truedepth calibrate moving --json > camera.json && truedepth audit still --calibration camera.json
  truedepth audit my-recording --json | jq '.findings[] | select(.verdict == \"fault\")'";

fn tolerance(text: &str) -> Result<String, ToleranceError> {
    Tolerances::default().with(text).map(|_| text.to_owned())
}

fn tolerance_help() -> String {
    format!(
        "What still counts as true, like focal=0.5%; may be given several times\n\n\
         A significant deviation beyond it is a fault. These values are the defaults: {} (distortion at the corner of \
         the image, zoom and shift of depth against colour).",
        Tolerances::defaults()
    )
}

#[derive(Debug, clap::Args)]
pub(crate) struct CalibrateArgs {
    /// A recording (folder or zip), or a folder of PNG or JPEG images of one camera
    ///
    /// Images without metadata need --board. Nothing is known of their camera: the principal point is always
    /// estimated, and fx and fy each where held-out images ask for it.
    #[arg(value_name = "REC")]
    pub(crate) recording: PathBuf,

    /// How to calibrate
    #[arg(long, default_value = "auto")]
    pub(crate) method: Method,

    /// Fit this camera model instead of the one that predicts held-out views best
    #[arg(long, value_name = "MODEL", conflicts_with = "method", value_parser = models())]
    pub(crate) model: Option<String>,

    /// Fit --model as OpenCV's calibrateCamera does: all corners alike, none left out, the board taken for flat
    ///
    /// To compare, not to use: boards are not flat, and prints not true to scale.
    #[arg(long, requires = "model")]
    pub(crate) plain: bool,

    /// Calibrate from at most so many views: of more, those that together tell most about the camera
    ///
    /// Of views that show the same picture one is taken before any gets a second. --method paper and --plain take all.
    #[arg(long, value_name = "N", default_value_t = truedepth::calibrate::MAX_VIEWS, value_parser = at_least_three)]
    pub(crate) views: usize,

    #[command(flatten)]
    pub(crate) input: InputArgs,

    #[command(flatten)]
    pub(crate) json: JsonArgs,

    #[command(flatten)]
    pub(crate) detail: DetailArgs,

    /// Write the calibration for another program
    ///
    /// Without --format its name decides: .cameramodel is mrcal's, .txt COLMAP's cameras.txt, .yml and .yaml OpenCV's,
    /// .json what --json prints. A lens that the format does not hold is fitted to the nearest it does, and how far off
    /// that is gets said.
    #[arg(long, value_name = "FILE")]
    pub(crate) export: Option<PathBuf>,

    /// The program that reads it
    #[arg(long, value_name = "FORMAT", requires = "export")]
    pub(crate) format: Option<ExportFormat>,

    /// Replace the file of --export where it is there already
    #[arg(long, requires = "export")]
    pub(crate) force: bool,
}

fn models() -> PossibleValuesParser {
    PossibleValuesParser::new(Model::ALL.map(Model::name))
}

/// Whose file is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ExportFormat {
    /// What --json prints
    Truedepth,
    /// OpenCV's FileStorage, YAML
    Opencv,
    /// Kalibr's camchain.yaml
    Kalibr,
    /// mrcal's .cameramodel
    Mrcal,
    /// COLMAP's cameras.txt
    Colmap,
    /// ROS' camera_info, YAML
    Ros,
    /// Open3D's PinholeCameraIntrinsic, JSON
    Open3d,
}

const CALIBRATE_EXAMPLES: &str = "\
Examples:
  truedepth calibrate my-recording
  truedepth calibrate my-recording --method paper
  truedepth calibrate my-recording --model brown --export camera.yml
  truedepth calibrate images --board 7x5:30mm:21mm:4X4_50 --export camchain.yaml --format kalibr
  truedepth calibrate my-recording --json > camera.json";

#[derive(Debug, clap::Args)]
pub(crate) struct DetectArgs {
    /// Recordings, folders of PNG or JPEG images, or images
    ///
    /// Pixels are taken as the file stores them: an orientation in the EXIF data of a JPEG is ignored.
    #[arg(required = true, value_name = "PATH")]
    pub(crate) paths: Vec<PathBuf>,

    #[command(flatten)]
    pub(crate) input: InputArgs,

    #[command(flatten)]
    pub(crate) json: JsonArgs,

    /// Say how long decoding and searching took, per image
    ///
    /// With --threads 1 images are searched one after another and the times are those of one core.
    #[arg(long)]
    pub(crate) timings: bool,

    /// Draw what was found over each image, into this folder
    ///
    /// One NAME.overlay.png per image, enlarged where that is small: corners with their ids in orange, markers in blue,
    /// candidates that were not taken as magenta crosses. The folder must be new or empty, unless --force is given.
    #[arg(long, value_name = "DIR")]
    pub(crate) overlay: Option<PathBuf>,

    /// Let --overlay use a folder that is not empty, and replace overlays of the same names
    #[arg(long, requires = "overlay")]
    pub(crate) force: bool,
}

const DETECT_EXAMPLES: &str = "\
Examples:
  truedepth detect my-recording
  truedepth detect photo.jpg --board 7x5:30mm:21mm:4X4_50 --overlay seen
  truedepth detect my-recording --json --timings --threads 1 > corners.json";

#[derive(Debug, clap::Args)]
pub(crate) struct DemoArgs {
    /// Where the report goes
    #[arg(short, long, value_name = "DIR", default_value = "truedepth-demo")]
    pub(crate) output: PathBuf,

    /// Chooses views, noise and light
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,

    #[command(flatten)]
    pub(crate) json: JsonArgs,

    /// Open the report in a browser
    #[arg(long)]
    pub(crate) open: bool,
}

const DEMO_EXAMPLES: &str = "\
Examples:
  truedepth demo
  truedepth demo --open
  truedepth demo --seed 7 -o another-demo";

#[derive(Debug, clap::Args)]
pub(crate) struct PrintArgs {
    /// The file to write: .pdf, .svg or .png
    ///
    /// A board.toml is written into the same folder.
    #[arg(short, long, value_name = "FILE", value_parser = printed_file)]
    pub(crate) output: PrintedFile,

    /// The board: a board.toml, SQUARES:SQUARE:MARKER:DICTIONARY, or `paper`
    ///
    /// In short form: squares along x and y, side of a square, side of a marker (black border included), dictionary
    /// as OpenCV names it or a file of OpenCV's form (mine.yml); `legacy` or `new` may follow. `paper` is the board of
    /// arXiv:2201.10865, 10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL:legacy. Markers of 0.5 to 0.7 squares leave a rim wide
    /// enough for corners to stay accurate in a blurred picture.
    #[arg(long, value_name = "FILE|SPEC|paper", default_value = "10x7:24mm:15mm:5X5_100", value_parser = print_board)]
    pub(crate) board: BoardArgument,

    /// The paper
    #[arg(long, value_name = "SIZE", default_value = "a4")]
    pub(crate) paper: PaperSize,

    /// How the paper is held
    #[arg(long, value_name = "WAY", default_value = "auto")]
    pub(crate) orientation: OrientationChoice,

    /// Which squares are white, where --board does not say it [default: new]
    ///
    /// `new` is OpenCV 4.6 and later, `legacy` what came before. They differ for an even number of rows only.
    #[arg(long, value_name = "LAYOUT")]
    pub(crate) layout: Option<LayoutChoice>,

    /// Pixels per inch of a PNG [default: 300]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(50..=1200))]
    pub(crate) dpi: Option<u32>,

    /// Replace files that are there already
    #[arg(long)]
    pub(crate) force: bool,
}

const BOARD_EXAMPLES: &str = "\
Examples:
  truedepth board -o board.pdf
  truedepth board -o a3.pdf --paper a3 --board 12x9:30mm:22mm:5X5_250
  truedepth board -o paper/board.pdf --board paper
  truedepth board -o board.png --dpi 600 --board 7x5:30mm:21mm:mine.yml";

/// Where the board goes, and as what.
#[derive(Clone, Debug)]
pub(crate) struct PrintedFile {
    pub(crate) path: PathBuf,
    pub(crate) format: PrintFormat,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PrintFormat {
    Pdf,
    Svg,
    Png,
}

fn printed_file(text: &str) -> Result<PrintedFile, String> {
    let path = PathBuf::from(text);
    let extension =
        path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let format = match extension.as_str() {
        "pdf" => PrintFormat::Pdf,
        "svg" => PrintFormat::Svg,
        "png" => PrintFormat::Png,
        _ => return Err("the name must end in .pdf, .svg or .png".to_owned()),
    };
    Ok(PrintedFile { path, format })
}

fn print_board(text: &str) -> Result<BoardArgument, board::Error> {
    if text == "paper" {
        return board_argument("10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL:legacy");
    }
    board_argument(text)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum PaperSize {
    /// 210 x 297 mm
    A4,
    /// 297 x 420 mm
    A3,
    /// 8.5 x 11 in
    Letter,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum OrientationChoice {
    /// As the board fits best
    Auto,
    /// The long side upright
    Portrait,
    /// The long side across
    Landscape,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum LayoutChoice {
    /// OpenCV 4.6 and newer
    New,
    /// OpenCV before 4.6
    Legacy,
}

#[derive(Debug, clap::Args)]
pub(crate) struct SimulateArgs {
    /// The folder to write; new or empty
    #[arg(short, long, value_name = "REC")]
    pub(crate) output: PathBuf,

    /// The device
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(Device::ALL.map(|d| d.name)))]
    pub(crate) device: String,

    /// What is wrong with it; may be given several times
    #[arg(long = "fault", value_name = "FAULT", value_parser = fault)]
    pub(crate) faults: Vec<String>,

    /// How the camera is led: round the board for calibration, or straight at it for depth
    #[arg(long, default_value = "hand-held")]
    pub(crate) trajectory: Trajectory,

    /// Frames to take [default: 50 hand-held, 5 fronto-parallel]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=10_000))]
    pub(crate) frames: Option<u16>,

    /// Chooses views, noise and light
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,

    #[command(flatten)]
    pub(crate) board: BoardArgs,
}

/// How a simulated camera is led.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Trajectory {
    /// Round the board, near and far, tilted
    HandHeld,
    /// Straight at the board, about 200 mm away
    FrontoParallel,
}

/// A fault that can be: all are read together.
fn fault(text: &str) -> Result<String, DefectError> {
    Faults::parse([text]).map(|_| text.to_owned())
}

fn simulate_help() -> String {
    let mut text = String::from(
        "\
Examples:
  truedepth simulate -o ipad --device ipad-12.9-5gen --fault focal=6.6%
  truedepth simulate -o still --device iphone-11-pro --trajectory fronto-parallel --seed 7
  truedepth simulate -o bad --device ipad-12.9-4gen --fault depth-zoom=0.9507 --fault mirrored

Faults:
",
    );
    for (form, words) in Faults::known() {
        text.push_str(&format!("  {form:<22} {words}\n"));
    }
    text
}

#[derive(Debug, clap::Args)]
pub(crate) struct ExplainArgs {
    /// The code of a finding, like TD201
    pub(crate) code: Option<String>,
}

const EXPLAIN_EXAMPLES: &str = "\
Examples:
  truedepth explain              all codes
  truedepth explain TD201        what it measures, why it matters, how it is done, what to do";

#[derive(Debug, clap::Args)]
pub(crate) struct CompletionsArgs {
    /// The shell
    pub(crate) shell: clap_complete::Shell,
}

const COMPLETIONS_EXAMPLES: &str = "\
Examples:
  truedepth completions bash > ~/.local/share/bash-completion/completions/truedepth
  truedepth completions zsh > ~/.zfunc/_truedepth
  truedepth completions fish > ~/.config/fish/completions/truedepth.fish";

#[derive(Debug, clap::Args)]
pub(crate) struct ManArgs {
    /// The verb whose page to print
    pub(crate) verb: Option<String>,
}

const MAN_EXAMPLES: &str = "\
Examples:
  truedepth man | man -l -
  truedepth man audit > truedepth-audit.1";

/// A number of views that can disagree.
fn at_least_three(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(n) if n >= 3 => Ok(n),
        _ => Err("a calibration takes at least 3 views: give a whole number from 3 on".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_definition_holds_together() {
        Args::command().debug_assert();
    }

    #[test]
    fn every_verb_shows_an_example_of_itself() {
        for verb in Args::command().get_subcommands() {
            let name = verb.get_name();
            let examples = verb.get_after_help().map(ToString::to_string).unwrap_or_default();
            assert!(examples.contains(&format!("truedepth {name}")), "{name}");
            assert!(verb.get_about().is_some(), "{name}");
        }
    }

    #[test]
    fn every_option_is_explained() {
        for verb in Args::command().get_subcommands() {
            for arg in verb.get_arguments() {
                assert!(arg.get_help().is_some(), "{} {}", verb.get_name(), arg.get_id());
            }
        }
    }
}
