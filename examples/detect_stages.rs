//! The pictures of `docs/method/detect.md`: what the detector sees, step by step, on a simulated picture with motion.
//!
//!     cargo run --release --example detect_stages -- docs/method/detect

use std::{fmt::Write as _, fs, io, path::PathBuf};

use truedepth::{
    board::CharucoBoard,
    camera::{Camera, Distortion, Intrinsics},
    detect::{Corner, Detector, Trace},
    geom::{Pose, Rotation, Vector3},
    image::{Gray, Rgb},
    report::{Photo, PhotoSize},
    simulate::{Motion, Noise, Scene, render},
};

const WIDTH: usize = 640;
const HEIGHT: usize = 480;

fn main() -> io::Result<()> {
    let folder = std::env::args_os().nth(1).map_or_else(|| PathBuf::from("."), PathBuf::from);
    fs::create_dir_all(&folder)?;
    let board: CharucoBoard =
        "10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL".parse().expect("a board that can be");
    let image = picture(&board);
    let detector = Detector::new(&board);
    let trace = detector.trace(&image).expect("the picture shows a board");
    let write = |name: &str, svg: String| fs::write(folder.join(name), svg);
    write("saddles.svg", saddles(&trace))?;
    write("lattice.svg", lattice(&trace, &image))?;
    write("corners.svg", corners(&trace.observation.corners, &image))
}

/// A tilted board, moved by 9 pixels while the shutter was open.
fn picture(board: &CharucoBoard) -> Gray {
    let (fx, cx, cy) = (590.0, WIDTH as f64 / 2.0, HEIGHT as f64 / 2.0);
    let intrinsics = Intrinsics { fx, fy: fx, cx, cy, width: WIDTH, height: HEIGHT };
    let camera = Camera { intrinsics, distortion: Distortion::None };
    let rotation =
        Rotation::from_euler_angles(0.4, -0.35, 0.0) * Rotation::from_euler_angles(0.0, 0.0, 0.3);
    let middle = Vector3::new(0.104, 0.0835, 0.0);
    let color_from_board = Pose::new(rotation, Vector3::new(0.0, 0.0, 0.27) - rotation * middle);
    let mut scene = Scene::ideal(board.clone(), camera, color_from_board);
    let moved_m = 9.0 * 0.27 / fx;
    scene.motion = Motion { translation_m: Vector3::new(0.8, 0.6, 0.0) * moved_m, ..Motion::NONE };
    scene.blur_sigma_px = 0.8;
    scene.noise = Noise::Gray { sigma: 2.0 };
    render(&scene, 1).gray()
}

/// An SVG of the image's size: a picture, and shapes over it.
fn svg(background: &Gray, shapes: &str) -> String {
    let gray = background.pixels().iter().map(|&v| [v; 3]).collect();
    let photo =
        Photo::new(0, &Rgb::new(background.width(), background.height(), gray), PhotoSize::Large);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"sans-serif\">\n\
         <image width=\"{WIDTH}\" height=\"{HEIGHT}\" preserveAspectRatio=\"none\" href=\"{}\"/>\n{shapes}</svg>\n",
        photo.data_uri()
    )
}

/// SVG puts integers on pixel corners.
fn at(p: truedepth::geom::Pixel) -> [f64; 2] {
    [p.x + 0.5, p.y + 0.5]
}

/// The smoothed level with the saddles found and the directions of their edges.
fn saddles(trace: &Trace) -> String {
    let mut shapes = String::from("<g stroke=\"#e69f00\" stroke-width=\"1.6\" fill=\"none\">\n");
    for (place, edges) in &trace.saddles {
        let [x, y] = at(*place);
        for [ex, ey] in edges {
            let _ =
                writeln!(shapes, "<path d=\"M{x:.1} {y:.1}l{:.1} {:.1}\"/>", 14.0 * ex, 14.0 * ey);
        }
        let _ = writeln!(shapes, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\"/>");
    }
    svg(&trace.level, &(shapes + "</g>\n"))
}

/// The largest lattice: nodes with their numbers, joined to their neighbours.
fn lattice(trace: &Trace, image: &Gray) -> String {
    let nodes = &trace.lattices[0];
    let mut shapes = String::from("<g stroke=\"#56b4e9\" stroke-width=\"1.6\">\n");
    for ([i, j], place) in nodes {
        let [x, y] = at(*place);
        for ([p, q], other) in nodes {
            if (p - i, q - j) == (1, 0) || (p - i, q - j) == (0, 1) {
                let [u, v] = at(*other);
                let _ = writeln!(shapes, "<path d=\"M{x:.1} {y:.1}L{u:.1} {v:.1}\"/>");
            }
        }
    }
    shapes += "</g>\n<g font-size=\"10\" fill=\"#fff\" stroke=\"#000\" stroke-width=\"2.5\" paint-order=\"stroke\">\n";
    for ([i, j], place) in nodes {
        let [x, y] = at(*place);
        let _ = writeln!(shapes, "<text x=\"{:.1}\" y=\"{:.1}\">{i},{j}</text>", x + 3.0, y - 3.0);
    }
    svg(image, &(shapes + "</g>\n"))
}

/// The corners with their ids; circles of twenty σ.
fn corners(corners: &[Corner], image: &Gray) -> String {
    let mut shapes = String::from("<g stroke=\"#d55e00\" stroke-width=\"1.4\" fill=\"none\">\n");
    for corner in corners {
        let [x, y] = at(corner.pixel);
        let r = 20.0 * corner.sigma_px;
        let _ = writeln!(
            shapes,
            "<path d=\"M{:.2} {y:.2}h6M{x:.2} {:.2}v6\"/><circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{r:.2}\"/>",
            x - 3.0,
            y - 3.0
        );
    }
    shapes += "</g>\n<g font-size=\"10\" fill=\"#fff\" stroke=\"#000\" stroke-width=\"2.5\" paint-order=\"stroke\">\n";
    for corner in corners {
        let [x, y] = at(corner.pixel);
        let _ = writeln!(
            shapes,
            "<text x=\"{:.1}\" y=\"{:.1}\">{}</text>",
            x + 4.0,
            y - 4.0,
            corner.id
        );
    }
    svg(image, &(shapes + "</g>\n"))
}
