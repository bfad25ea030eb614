//! Pictures of the published recordings: figures 3 and 7.

use crate::{
    correct::Plan,
    image::Rgb,
    recording::Defect,
    report::{
        After, Animation, DepthPictures, DepthStyle, Error, Flip, LensPictures, Photo, PhotoSize,
        Range, Shown, state_in_words,
    },
    reproduce::{Reproduction, Set},
};

/// What ARKit's depth was made by.
const ZOOM: f64 = 0.9507;

/// A picture with its words.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PlatePicture {
    pub(super) photo: Photo,
    pub(super) caption: String,
}

impl PlatePicture {
    fn new(frame: usize, image: &Rgb, caption: String) -> Self {
        Self { photo: Photo::new(frame, image, PhotoSize::Whole), caption }
    }
}

/// Pictures for [`paper_page`](super::paper_page).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PaperPictures {
    pub(super) lens: Vec<PlatePicture>,
    pub(super) zoom: Vec<PlatePicture>,
}

impl PaperPictures {
    /// Draws figure 7 of every calibration recording with a lens, and what figure 3 shows from the recording of a
    /// device that has issue 1.
    pub fn read(paper: &Reproduction) -> Result<Self, Error> {
        let mut pictures = Self::default();
        for lens in &paper.lens {
            let recording = &paper.data[lens.data].recording;
            let drawn = LensPictures {
                recording,
                rectifier: &lens.rectifier,
                board: recording.board.as_ref(),
                frames: Some(vec![lens.frame]),
            };
            let words = state_in_words(&lens.rectifier, &lens.straightness);
            let caption =
                format!("{}, {} frames. {words}", lens.title, lens.straightness.n_frames());
            pictures.lens.push(PlatePicture::new(lens.frame, &drawn.one(lens.frame)?, caption));
        }
        let issue_1 = paper.data.iter().find(|d| {
            d.set == Set::Calibration && d.device.as_deref().is_some_and(|d| d.ends_with("4gen"))
        });
        if let Some(data) = issue_1 {
            let zoom = [1.0 / ZOOM; 2];
            let plan = Plan::given(&[Defect::DepthZoom { zoom }])?;
            let drawn = DepthPictures {
                recording: &data.recording,
                after: After::Corrected(&plan),
                frames: None,
                range: Range::Recording,
                style: DepthStyle { range_m: [0.15, 0.4], opacity: 0.65, shown: Shown::Edges },
                flip: Flip::No,
                animation: Animation::No,
            };
            let titles = ["AVFoundation, as recorded", "made from it: as ARKit delivers depth"];
            let (frame, image) = drawn.most_edges(titles)?;
            let caption = "No ARKit recording was published. Left the published AVFoundation recording of an iPad \
                           12.9\" 4gen with the edges of its depth in orange; right its depth zoomed by 1/0.9507, as \
                           the paper describes ARKit's: the edges leave the things they belong to.";
            pictures.zoom.push(PlatePicture::new(frame, &image, caption.to_owned()));
        }
        Ok(pictures)
    }
}
