//! Pages as the bytes of a PDF file (ISO 32000-1). Texts are not compressed, pictures are.

use super::block::Op;
use super::metrics::Font;
use super::picture::Raster;
use super::sheet::{HEIGHT, WIDTH};
use crate::canvas::Rgb;
use pdf_writer::types::Predictor;
use pdf_writer::{Content, Date, Filter, Finish, Name, Pdf, Rect, Ref, Str, TextStr};

const CATALOG: Ref = Ref::new(1);
const TREE: Ref = Ref::new(2);
const INFO: Ref = Ref::new(3);
const FONTS: [(Ref, &[u8], &[u8]); 2] =
    [(Ref::new(4), b"Plain", b"Helvetica"), (Ref::new(5), b"Bold", b"Helvetica-Bold")];
/// The first number of pictures, pages and their contents.
const FIRST: i32 = 6;

/// What a reader shows of the document beside its pages.
#[derive(Debug)]
pub(super) struct About<'a> {
    pub(super) title: &'a str,
    pub(super) producer: &'a str,
    /// `YYYY-MM-DD HH:MM:SS`.
    pub(super) date: &'a str,
}

/// The file; things on `pages` lie y downwards from the upper edge, points.
pub(super) fn bytes(pages: &[Vec<Op>], pictures: &[Raster], about: &About<'_>) -> Vec<u8> {
    let reference = |n: usize| Ref::new(FIRST + n as i32);
    let picture = |n: usize| reference(n);
    let page = |n: usize| reference(pictures.len() + 2 * n);
    let content = |n: usize| reference(pictures.len() + 2 * n + 1);
    let mut pdf = Pdf::new();
    let mut catalog = pdf.catalog(CATALOG);
    catalog.pages(TREE).lang(TextStr("en"));
    catalog.viewer_preferences().display_doc_title(true);
    catalog.finish();
    let kids = (0..pages.len()).map(page);
    pdf.pages(TREE).kids(kids).count(pages.len() as i32);
    inform(&mut pdf, about);
    for (font, _, base) in FONTS {
        let mut font = pdf.type1_font(font);
        font.base_font(Name(base)).encoding_predefined(Name(b"WinAnsiEncoding"));
    }
    for (n, raster) in pictures.iter().enumerate() {
        put_picture(&mut pdf, picture(n), raster);
    }
    for (n, ops) in pages.iter().enumerate() {
        let mut written = pdf.page(page(n));
        written.parent(TREE).contents(content(n));
        written.media_box(Rect::new(0.0, 0.0, WIDTH as f32, HEIGHT as f32));
        let mut resources = written.resources();
        let mut fonts = resources.fonts();
        for (font, name, _) in FONTS {
            fonts.pair(Name(name), font);
        }
        fonts.finish();
        let mut shown = resources.x_objects();
        for op in ops {
            if let Op::Picture { number, .. } = op {
                shown.pair(Name(&name_of(*number)), picture(*number));
            }
        }
        shown.finish();
        resources.finish();
        written.finish();
        pdf.stream(content(n), &drawn(ops));
    }
    pdf.finish()
}

/// Title, maker and date.
fn inform(pdf: &mut Pdf, about: &About<'_>) {
    let mut info = pdf.document_info(INFO);
    info.title(TextStr(about.title)).producer(TextStr(about.producer));
    let digits: Vec<u16> =
        about.date.split(['-', ' ', ':']).filter_map(|part| part.parse().ok()).collect();
    if let [year, month, day, hour, minute, second] = digits[..] {
        let [month, day, hour, minute, second] =
            [month, day, hour, minute, second].map(|n| n as u8);
        let date = Date::new(year).month(month).day(day).hour(hour).minute(minute).second(second);
        info.creation_date(date);
    }
}

fn put_picture(pdf: &mut Pdf, at: Ref, raster: &Raster) {
    let mut image = pdf.image_xobject(at, &raster.deflated);
    image.width(raster.width as i32).height(raster.height as i32).bits_per_component(8);
    image.color_space().device_rgb();
    image.filter(Filter::FlateDecode);
    let mut parameters = image.decode_parms();
    parameters.predictor(Predictor::PngOptimum).colors(3).bits_per_component(8);
    parameters.columns(raster.width as i32);
}

fn name_of(picture: usize) -> Vec<u8> {
    format!("Picture{picture}").into_bytes()
}

/// The operators of a page, whose y points up from its lower edge.
fn drawn(ops: &[Op]) -> Vec<u8> {
    let mut content = Content::new();
    for op in ops {
        match op {
            Op::Fill { at: [x, y], size: [w, h], rgb } => {
                fill(&mut content, *rgb);
                content.rect(short(*x), short(HEIGHT - y - h), short(*w), short(*h)).fill_nonzero();
            }
            Op::Picture { at: [x, y], size: [w, h], number } => {
                content.save_state();
                let place = [short(*w), 0.0, 0.0, short(*h), short(*x), short(HEIGHT - y - h)];
                content.transform(place).x_object(Name(&name_of(*number))).restore_state();
            }
            Op::Text { at: [x, y], style, letters } => {
                let (_, font, _) = FONTS[usize::from(style.font == Font::Bold)];
                fill(&mut content, style.rgb);
                content.begin_text().set_font(Name(font), short(style.size));
                content.next_line(short(*x), short(HEIGHT - y)).show(Str(letters)).end_text();
            }
        }
    }
    content.finish().to_vec()
}

fn fill(content: &mut Content, rgb: Rgb) {
    let [red, green, blue] = rgb.map(|c| short(f64::from(c) / 255.0));
    content.set_fill_rgb(red, green, blue);
}

/// To a thousandth, in as few digits.
fn short(x: f64) -> f32 {
    ((x * 1000.0).round() / 1000.0) as f32
}
