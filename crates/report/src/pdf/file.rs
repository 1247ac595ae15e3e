//! Pages as the bytes of a PDF file, by krilla: PDF/A-2a, with its fonts in it and tagged for those
//! who have it read to them.

use super::block::{Op, Role};
use super::sheet::{HEIGHT, WIDTH};
use crate::Error;
use crate::canvas::Rgb;
use crate::encoded::EncodedPicture;
use crate::fonts::{Face, Placed};
use krilla::color::rgb;
use krilla::configure::{Archival, ConfigurationBuilder};
use krilla::geom::{PathBuilder, Point, Rect, Size, Transform};
use krilla::image::Image;
use krilla::metadata::{DateTime, Metadata};
use krilla::page::PageSettings;
use krilla::paint::Fill;
use krilla::surface::Surface;
use krilla::tagging::{
    Artifact, ArtifactType, ContentTag, ListNumbering, Node, SpanTag, TableHeaderScope, Tag,
    TagGroup, TagKind, TagTree,
};
use krilla::text::{Font, GlyphId, KrillaGlyph};
use krilla::{Document, SerializeSettings};
use std::num::NonZeroU16;

/// The file; things on `pages` lie y downwards from the upper edge, points. A reader shows title,
/// maker and date (`YYYY-MM-DD HH:MM:SS`) beside them.
///
/// # Errors
/// [`Error::Pdf`] with what krilla says.
pub(super) fn bytes(
    pages: &[Vec<Op>],
    pictures: &[&EncodedPicture],
    about: (String, String, &str),
) -> Result<Vec<u8>, Error> {
    let configuration = ConfigurationBuilder::new().with_archival_validator(Archival::A2_A);
    let configuration = configuration.finish().map_err(|error| failed(format!("{error:?}")))?;
    let mut document =
        Document::new_with(SerializeSettings { configuration, ..Default::default() });
    let [plain, bold] = [Face::Plain, Face::Bold].map(|face| Font::new(face.file().into(), 0));
    let fonts = [plain, bold].into_iter().collect::<Option<Vec<_>>>();
    let fonts = fonts.ok_or_else(|| failed("the fonts cannot be read"))?;
    let image = |picture: &&EncodedPicture| {
        Image::from_png(picture.png.clone().into(), false).map_err(failed)
    };
    let images = pictures.iter().map(image).collect::<Result<Vec<_>, _>>()?;
    let settings = PageSettings::from_wh(WIDTH as f32, HEIGHT as f32);
    let mut tags = Tags::default();
    for ops in pages {
        let mut page = document.start_page_with(settings.clone().unwrap_or_default());
        let mut surface = page.surface();
        for op in ops {
            draw(&mut surface, &mut tags, op, (&fonts, &images));
        }
        surface.finish();
        page.finish();
    }
    document.set_tag_tree(tags.tree);
    document.set_metadata(metadata(about));
    document.finish().map_err(failed)
}

fn failed(error: impl ToString) -> Error {
    Error::Pdf(error.to_string())
}

/// Title, maker, language and date.
fn metadata((title, producer, date): (String, String, &str)) -> Metadata {
    let data = Metadata::new().title(title).producer(producer).language("en".into());
    let numbers: Vec<u16> =
        date.split(['-', ' ', ':']).filter_map(|part| part.parse().ok()).collect();
    let [year, rest @ ..] = &numbers[..] else { return data };
    let [month, day, hour, minute, second] =
        std::array::from_fn(|n| *rest.get(n).unwrap_or(&0) as u8);
    let date = DateTime::new(*year).month(month).day(day).hour(hour).minute(minute).second(second);
    data.creation_date(date)
}

fn draw(surface: &mut Surface<'_>, tags: &mut Tags, op: &Op, (fonts, images): (&[Font], &[Image])) {
    let point = |[x, y]: [f64; 2]| Point::from_xy(x as f32, y as f32);
    match op {
        Op::Open(role) => tags.open(*role),
        Op::Close => tags.close(),
        Op::Fill { at: [x, y], size: [w, h], rgb } => {
            let mut path = PathBuilder::new();
            let rect = Rect::from_xywh(*x as f32, *y as f32, *w as f32, *h as f32);
            rect.into_iter().for_each(|rect| path.push_rect(rect));
            surface.start_tagged(aside());
            surface.set_fill(Some(filled(*rgb)));
            path.finish().iter().for_each(|path| surface.draw_path(path));
            surface.end_tagged();
        }
        Op::Picture { at, size: [w, h], number, told } => {
            let Some(size) = Size::from_wh(*w as f32, *h as f32) else { return };
            let id = surface.start_tagged(ContentTag::Other);
            surface.push_transform(&Transform::from_translate(at[0] as f32, at[1] as f32));
            surface.draw_image(images[*number].clone(), size);
            surface.pop();
            surface.end_tagged();
            let figure = Tag::Figure(Some(told.clone()));
            tags.put(TagGroup::with_children(figure, vec![id.into()]));
        }
        Op::Text { at, style, text } => {
            let told = tags.told();
            let tag = if told { ContentTag::Span(SpanTag::empty()) } else { aside() };
            let id = surface.start_tagged(tag);
            surface.set_fill(Some(filled(style.rgb)));
            let glyph = |letter: Placed| {
                let (glyph, advance) = (GlyphId::new(letter.glyph.to_u32()), letter.advance as f32);
                KrillaGlyph::new(glyph, advance, 0.0, 0.0, 0.0, letter.bytes, None)
            };
            let glyphs: Vec<KrillaGlyph> = style.face.line(text).into_iter().map(glyph).collect();
            let font = fonts[usize::from(style.face == Face::Bold)].clone();
            surface.draw_glyphs(point(*at), &glyphs, font, text, style.size as f32, false);
            surface.end_tagged();
            if told {
                tags.put(id);
            }
        }
    }
}

fn filled([red, green, blue]: Rgb) -> Fill {
    Fill { paint: rgb::Color::new(red, green, blue).into(), ..Fill::default() }
}

/// What is no part of what is told: grounds, lines, heads and feet of pages.
fn aside() -> ContentTag<'static> {
    ContentTag::Artifact(Artifact::with_kind(ArtifactType::Other))
}

/// What the page says, in its order, while it is drawn.
#[derive(Default)]
struct Tags {
    tree: TagTree,
    /// What is open, the innermost last; nothing for what is not told.
    open: Vec<Option<TagGroup>>,
}

impl Tags {
    fn open(&mut self, role: Role) {
        let told = !matches!(self.open.last(), Some(None));
        self.open.push(kind(role).filter(|_| told).map(TagGroup::new));
    }

    fn close(&mut self) {
        if let Some(Some(group)) = self.open.pop() {
            self.put(group);
        }
    }

    fn put(&mut self, node: impl Into<Node>) {
        match self.open.last_mut() {
            Some(Some(group)) => group.push(node),
            _ => self.tree.push(node),
        }
    }

    /// Whether what is drawn now is told.
    fn told(&self) -> bool {
        matches!(self.open.last(), Some(Some(_)))
    }
}

fn kind(role: Role) -> Option<TagKind> {
    Some(match role {
        Role::Aside => return None,
        Role::Title => Tag::Hn(NonZeroU16::MIN, None).into(),
        Role::Heading => Tag::Hn(NonZeroU16::MIN.saturating_add(1), None).into(),
        Role::Paragraph => Tag::P.into(),
        Role::Caption => Tag::Caption.into(),
        Role::List => Tag::L(ListNumbering::None).into(),
        Role::Item => Tag::LI.into(),
        Role::Label => Tag::Lbl.into(),
        Role::Body => Tag::LBody.into(),
        Role::Table => Tag::Table.into(),
        Role::Row => Tag::TR.into(),
        Role::ColumnHead => Tag::TH(TableHeaderScope::Column).into(),
        Role::RowHead => Tag::TH(TableHeaderScope::Row).into(),
        Role::Cell => Tag::TD.into(),
    })
}
