//! Walks the elements of a data set: no recursion, no allocation by a length that was not checked.
//!
//! PS3.5 section 7. Refused: a length beyond the bytes that are left, nesting beyond [`MAX_DEPTH`],
//! more than [`MAX_ELEMENTS`] elements, delimiters where none belong, a tag twice.

use super::{DataSet, Element, Value};
use dicom_core::dictionary::{DataDictionary as _, DataDictionaryEntry as _};
use dicom_core::{Tag, VR};
use dicom_dictionary_std::{StandardDataDictionary, tags};

/// Deepest nesting of sequences that is read; real objects use 3 to 6.
const MAX_DEPTH: usize = 32;
/// Most elements in a file; a multi-frame object of 2000 frames has about 100 000.
const MAX_ELEMENTS: usize = 400_000;
/// The length that says "until the delimiter".
pub(super) const UNDEFINED: u32 = u32::MAX;

const ITEM: Tag = Tag(0xFFFE, 0xE000);
const ITEM_END: Tag = Tag(0xFFFE, 0xE00D);
const SEQUENCE_END: Tag = Tag(0xFFFE, 0xE0DD);

/// How elements are laid out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Encoding {
    pub(crate) explicit: bool,
    pub(crate) big_endian: bool,
}

/// Where the walk ends before the bytes do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Until {
    /// The end of the bytes.
    End,
    /// The first top-level element of another group.
    GroupEnds(u16),
    /// Pixel Data, whose length is checked but whose native bytes need not be there.
    PixelData,
}

/// Why a walk ended early.
#[derive(Debug, PartialEq)]
pub(crate) enum Fault {
    /// The file has more bytes, which are needed.
    NeedMore,
    /// The bytes are no data set; the Series Instance UID if it came before the fault.
    Bad { reason: String, series: Option<String> },
}

/// A data set with the place of its end.
#[derive(Debug)]
pub(crate) struct Parsed {
    pub(crate) set: DataSet,
    pub(crate) end: usize,
    /// Length of native Pixel Data when the walk stopped there.
    pub(crate) pixel_bytes: Option<usize>,
    /// Whether the walk stopped at Pixel Data with anything in it, native or in fragments.
    pub(crate) has_pixels: bool,
    /// Bytes behind the last element: no part of the data set, but of its file.
    pub(crate) behind: usize,
}

/// What is being filled.
enum Open {
    Item { end: Option<usize>, elements: Vec<Element>, implicit: bool },
    Sequence { tag: Tag, end: Option<usize>, items: Vec<DataSet>, implicit: bool },
}

struct Header {
    tag: Tag,
    vr: VR,
    length: u32,
}

struct Walk<'a> {
    bytes: &'a [u8],
    /// Length of the whole file, of which `bytes` may be the beginning.
    total: usize,
    at: usize,
    encoding: Encoding,
    count: usize,
    stack: Vec<Open>,
    /// How many items and sequences are open around `bytes`.
    around: usize,
    behind: usize,
    /// Where the last element at the top ended whose pixels were read, and how many came with it.
    sound: Option<(usize, usize)>,
    has_pixels: bool,
}

/// The data set that starts at `start`. `total` is the length of the whole file, of which `bytes`
/// may be only the beginning.
pub(crate) fn parse(
    bytes: &[u8],
    total: usize,
    start: usize,
    encoding: Encoding,
    until: Until,
) -> Result<Parsed, Fault> {
    let root = Open::Item { end: Some(total), elements: Vec::new(), implicit: !encoding.explicit };
    let mut walk = Walk {
        bytes,
        total,
        at: start,
        encoding,
        count: 0,
        stack: vec![root],
        around: 0,
        behind: 0,
        sound: None,
        has_pixels: false,
    };
    let pixel_bytes = match walk.run(until) {
        Err(Fault::Bad { .. }) if walk.pass_over() => None,
        run => run.map_err(|fault| walk.with_series(fault))?,
    };
    let (end, behind, has_pixels) = (walk.at, walk.behind, walk.has_pixels);
    match walk.stack.pop() {
        Some(Open::Item { elements, .. }) if walk.stack.is_empty() => {
            Ok(Parsed { set: collect(elements, end)?, end, pixel_bytes, has_pixels, behind })
        }
        _ => bad("ends inside a sequence"),
    }
}

fn bad<T>(reason: impl Into<String>) -> Result<T, Fault> {
    Err(Fault::Bad { reason: reason.into(), series: None })
}

fn collect(elements: Vec<Element>, at: usize) -> Result<DataSet, Fault> {
    match DataSet::from_elements(elements) {
        Ok(set) => Ok(set),
        Err(tag) => bad(format!("{tag} is there twice (before byte {at})")),
    }
}

impl Walk<'_> {
    fn run(&mut self, until: Until) -> Result<Option<usize>, Fault> {
        loop {
            self.close_finished()?;
            let top_level = self.stack.len() == 1;
            if top_level && self.at == self.total {
                return Ok(None);
            }
            // The group that ends is the file header's, and what follows may be laid out otherwise.
            if let Until::GroupEnds(group) = until
                && top_level
                && self.bytes.get(self.at..self.at + 2).is_some_and(|g| *g != group.to_le_bytes())
            {
                return Ok(None);
            }
            if top_level && !matches!(until, Until::GroupEnds(_)) && self.only_zeros_follow()? {
                return Ok(None);
            }
            let last = if top_level { self.note_sound() } else { None };
            let start = self.at;
            let header = self.header()?;
            if last.is_some_and(|last| header.tag <= last) {
                return bad(format!("{} is not in its order, at byte {start}", header.tag));
            }
            match until {
                Until::PixelData if top_level && header.tag == tags::PIXEL_DATA => {
                    if header.length == UNDEFINED {
                        // The first is the table of offsets (PS3.5 A.4).
                        self.has_pixels = self.fragments(false)?.len() > 1;
                        return Ok(None);
                    }
                    self.check_length(&header, start)?;
                    self.has_pixels = header.length > 0;
                    return Ok(Some(header.length as usize));
                }
                _ => self.element(header, start)?,
            }
        }
    }

    /// Whether all that follows is zeros, which media and programs that write in blocks leave; then
    /// the walk is done.
    fn only_zeros_follow(&mut self) -> Result<bool, Fault> {
        let soon = self.total.min(self.at + 4);
        if self.at == 0 || self.bytes.get(self.at..soon).is_none_or(|b| b.iter().any(|&b| b != 0)) {
            return Ok(false);
        }
        let Some(rest) = self.bytes.get(self.at..self.total) else { return Err(Fault::NeedMore) };
        if rest.iter().all(|&b| b == 0) {
            self.behind = rest.len();
            self.at = self.total;
        }
        Ok(self.behind > 0)
    }

    /// Notes that all up to here is sound when it holds the pixels; the last element's tag then.
    fn note_sound(&mut self) -> Option<Tag> {
        let Some(Open::Item { elements, .. }) = self.stack.first() else { return None };
        let last = elements.last().map(|e| e.tag).filter(|tag| *tag >= tags::PIXEL_DATA)?;
        self.sound = Some((self.at, elements.len()));
        Some(last)
    }

    /// Passes over what is no element behind the pixels, which are the last that an image has to
    /// hold: something that was put behind the file. Whether there is such.
    fn pass_over(&mut self) -> bool {
        let Some((at, sound)) = self.sound else { return false };
        self.stack.truncate(1);
        if let Some(Open::Item { elements, .. }) = self.stack.first_mut() {
            elements.truncate(sound);
        }
        self.behind = self.total - at;
        self.at = self.total;
        true
    }

    /// The fault, with the series it is of if the walk came that far.
    fn with_series(&self, fault: Fault) -> Fault {
        let (Fault::Bad { reason, .. }, Some(Open::Item { elements, .. })) =
            (&fault, self.stack.first())
        else {
            return fault;
        };
        let series = elements.iter().find(|e| e.tag == tags::SERIES_INSTANCE_UID);
        let series = series.and_then(|e| match &e.value {
            Value::Bytes(bytes) => Some(super::text_of(bytes)),
            _ => None,
        });
        Fault::Bad { reason: reason.clone(), series }
    }

    /// Closes items and sequences of stated length that end here.
    fn close_finished(&mut self) -> Result<(), Fault> {
        while self.stack.len() > 1 {
            let end = match &self.stack[self.stack.len() - 1] {
                Open::Item { end, .. } | Open::Sequence { end, .. } => *end,
            };
            match end {
                Some(end) if self.at == end => self.close()?,
                Some(end) if self.at > end => {
                    return bad(format!("an element overruns its sequence at byte {end}"));
                }
                _ => break,
            }
        }
        Ok(())
    }

    /// Moves the innermost open item or sequence into what holds it.
    fn close(&mut self) -> Result<(), Fault> {
        match (self.stack.pop(), self.stack.last_mut()) {
            (Some(Open::Item { elements, .. }), Some(Open::Sequence { items, .. })) => {
                items.push(collect(elements, self.at)?);
                Ok(())
            }
            (Some(Open::Sequence { tag, items, .. }), Some(Open::Item { elements, .. })) => {
                elements.push(Element { tag, vr: VR::SQ, value: Value::Items(items) });
                Ok(())
            }
            _ => bad(format!("a delimiter without a beginning at byte {}", self.at)),
        }
    }

    fn element(&mut self, header: Header, start: usize) -> Result<(), Fault> {
        self.count += 1;
        if self.count > MAX_ELEMENTS {
            return bad(format!("more than {MAX_ELEMENTS} elements"));
        }
        let Some(top) = self.stack.last_mut() else { return bad("no data set is open") };
        match (header.tag, top) {
            (ITEM_END, Open::Item { end: None, .. })
            | (SEQUENCE_END, Open::Sequence { end: None, .. }) => self.close(),
            (ITEM, Open::Sequence { implicit, .. }) => {
                let implicit = *implicit;
                let end = self.stated_end(&header, start)?;
                self.open(Open::Item { end, elements: Vec::new(), implicit }, start)
            }
            (tag, Open::Item { implicit, .. }) if tag.0 != 0xFFFE => {
                let implicit = *implicit;
                self.value(header, start, implicit)
            }
            (tag, _) => bad(format!("{tag} where it does not belong, at byte {start}")),
        }
    }

    fn value(&mut self, header: Header, start: usize, implicit: bool) -> Result<(), Fault> {
        let Header { tag, vr, length } = header;
        if length == UNDEFINED && tag == tags::PIXEL_DATA && self.stack.len() == 1 {
            let fragments = self.fragments(true)?;
            return self.push(Element { tag, vr, value: Value::Fragments(fragments) });
        }
        if length == UNDEFINED || vr == VR::SQ {
            let end = self.stated_end(&header, start)?;
            // PS3.5 6.2.2: a sequence under UN of undefined length is implicit VR little endian.
            let implicit = implicit || (vr == VR::UN && length == UNDEFINED);
            return self.open(Open::Sequence { tag, end, items: Vec::new(), implicit }, start);
        }
        self.check_length(&header, start)?;
        let mut bytes = self.take(length as usize)?.to_vec();
        if vr == VR::UN && dictionary_vr(tag) == VR::SQ {
            return match self.unknown_items(&bytes) {
                Some((items, count)) => {
                    self.count += count;
                    self.push(Element { tag, vr: VR::SQ, value: Value::Items(items) })
                }
                None => self.push(Element { tag, vr, value: Value::Bytes(bytes) }),
            };
        }
        if self.encoding.big_endian {
            swap(&mut bytes, vr);
        }
        self.push(Element { tag, vr, value: Value::Bytes(bytes) })
    }

    /// The items of a sequence that came as UN with its length, and how many elements they have:
    /// implicit VR little endian by the standard (PS3.5 6.2.2 note), explicit by some programs.
    /// None when the bytes are neither: they stay what they are.
    fn unknown_items(&self, bytes: &[u8]) -> Option<(Vec<DataSet>, usize)> {
        [false, true].into_iter().find_map(|explicit| {
            let encoding = Encoding { explicit, big_endian: false };
            let sequence = Open::Sequence {
                tag: ITEM,
                end: Some(bytes.len()),
                items: Vec::new(),
                implicit: !explicit,
            };
            let root = Open::Item { end: None, elements: Vec::new(), implicit: !explicit };
            let mut walk = Walk {
                bytes,
                total: bytes.len(),
                at: 0,
                encoding,
                count: self.count,
                stack: vec![root, sequence],
                around: self.around + self.stack.len(),
                behind: 0,
                sound: None,
                has_pixels: false,
            };
            if walk.around > 2 * MAX_DEPTH {
                return None;
            }
            walk.run(Until::End).ok()?;
            let Some(Open::Item { mut elements, .. }) = walk.stack.pop() else { return None };
            match elements.pop()?.value {
                Value::Items(items) => Some((items, walk.count - self.count)),
                _ => None,
            }
        })
    }

    fn push(&mut self, element: Element) -> Result<(), Fault> {
        match self.stack.last_mut() {
            // Group lengths are redundant and go stale.
            Some(Open::Item { elements, .. }) => {
                if element.tag.1 != 0 {
                    elements.push(element);
                }
                Ok(())
            }
            _ => bad("an element outside a data set"),
        }
    }

    fn open(&mut self, open: Open, start: usize) -> Result<(), Fault> {
        if self.around + self.stack.len() > 2 * MAX_DEPTH {
            return bad(format!("nested deeper than {MAX_DEPTH} at byte {start}"));
        }
        self.stack.push(open);
        Ok(())
    }

    /// Walks the offset table and fragments of encapsulated pixel data; keeps them if asked.
    fn fragments(&mut self, keep: bool) -> Result<Vec<Vec<u8>>, Fault> {
        let mut fragments = Vec::new();
        loop {
            let start = self.at;
            let header = self.header()?;
            match header.tag {
                SEQUENCE_END => return Ok(fragments),
                ITEM if header.length != UNDEFINED => {
                    self.check_length(&header, start)?;
                    let fragment = self.take(header.length as usize)?;
                    fragments.push(if keep { fragment.to_vec() } else { Vec::new() });
                }
                tag => return bad(format!("{tag} among pixel fragments at byte {start}")),
            }
            if fragments.len() > MAX_ELEMENTS {
                return bad("too many pixel fragments");
            }
        }
    }

    fn stated_end(&self, header: &Header, start: usize) -> Result<Option<usize>, Fault> {
        if header.length == UNDEFINED {
            return Ok(None);
        }
        self.check_length(header, start)?;
        Ok(Some(self.at + header.length as usize))
    }

    fn check_length(&self, header: &Header, start: usize) -> Result<(), Fault> {
        let (length, left) = (header.length as usize, self.total - self.at);
        if length > left {
            let tag = header.tag;
            return bad(format!(
                "{tag} at byte {start} declares {length} bytes, {left} are left: cut short?"
            ));
        }
        Ok(())
    }

    fn take(&mut self, length: usize) -> Result<&[u8], Fault> {
        let end = self.at + length;
        if end > self.total {
            return bad(format!("ends inside an element at byte {}: cut short?", self.at));
        }
        let Some(bytes) = self.bytes.get(self.at..end) else { return Err(Fault::NeedMore) };
        self.at = end;
        Ok(bytes)
    }

    fn header(&mut self) -> Result<Header, Fault> {
        let (start, big) = (self.at, self.encoding.big_endian);
        let implicit = match self.stack.last() {
            Some(Open::Item { implicit, .. } | Open::Sequence { implicit, .. }) => *implicit,
            None => !self.encoding.explicit,
        };
        let u16_at = |b: &[u8], at: usize| {
            let pair = [b[at], b[at + 1]];
            if big { u16::from_be_bytes(pair) } else { u16::from_le_bytes(pair) }
        };
        let u32_at = |b: &[u8], at: usize| {
            let four = [b[at], b[at + 1], b[at + 2], b[at + 3]];
            if big { u32::from_be_bytes(four) } else { u32::from_le_bytes(four) }
        };
        let head = self.take(8)?;
        let tag = Tag(u16_at(head, 0), u16_at(head, 2));
        if tag.0 == 0xFFFE || implicit {
            let length = u32_at(head, 4);
            let vr = if tag.0 == 0xFFFE { VR::UN } else { dictionary_vr(tag) };
            return Ok(Header { tag, vr, length });
        }
        let Some(vr) = VR::from_binary([head[4], head[5]]) else {
            return bad(format!("{tag} at byte {start} has no known value representation"));
        };
        if !has_long_length(vr) {
            let length = u32::from(u16_at(head, 6));
            return Ok(Header { tag, vr, length });
        }
        let long = self.take(4)?;
        let length = u32_at(long, 0);
        // A public element that lost its VR on the way gets it back (PS3.5 6.2.2 note); a sequence
        // does not, since its items are implicit VR.
        let vr = match dictionary_vr(tag) {
            known if vr == VR::UN && length != UNDEFINED && known != VR::SQ => known,
            _ => vr,
        };
        Ok(Header { tag, vr, length })
    }
}

/// VRs whose explicit header has a 32-bit length (PS3.5 7.1.2).
pub(super) fn has_long_length(vr: VR) -> bool {
    use VR::{OB, OD, OF, OL, OV, OW, SQ, SV, UC, UN, UR, UT, UV};
    matches!(vr, OB | OD | OF | OL | OV | OW | SQ | SV | UC | UN | UR | UT | UV)
}

/// The VR of the standard's dictionary, UN for what it does not know.
pub(crate) fn dictionary_vr(tag: Tag) -> VR {
    StandardDataDictionary.by_tag(tag).map_or(VR::UN, |entry| entry.vr().relaxed())
}

/// Big-endian numbers to little endian.
fn swap(bytes: &mut [u8], vr: VR) {
    use VR::{AT, FD, FL, OD, OF, OL, OV, OW, SL, SS, SV, UL, US, UV};
    let width = match vr {
        AT | OW | SS | US => 2,
        FL | OF | OL | SL | UL => 4,
        FD | OD | OV | SV | UV => 8,
        _ => return,
    };
    bytes.chunks_exact_mut(width).for_each(<[u8]>::reverse);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data_set::{encode, encode_implicit};
    use dicom_dictionary_std::tags;

    const EXPLICIT: Encoding = Encoding { explicit: true, big_endian: false };

    fn item() -> DataSet {
        let mut inner = DataSet::default();
        inner.put_text(tags::REFERENCED_SOP_INSTANCE_UID, VR::UI, "1.2.3.4");
        let mut item = DataSet::default();
        item.put_text(tags::ROI_NAME, VR::LO, "Breast");
        item.put_items(tags::CONTOUR_IMAGE_SEQUENCE, vec![inner]);
        item
    }

    fn known() -> DataSet {
        let mut set = DataSet::default();
        set.put_items(tags::ROI_CONTOUR_SEQUENCE, vec![item(), item()]);
        set
    }

    /// The sequence of `known` as UN of its length, its items encoded by `items`.
    fn unknown(items: &[u8]) -> DataSet {
        let mut set = DataSet::default();
        set.put(tags::ROI_CONTOUR_SEQUENCE, VR::UN, Value::Bytes(items.to_vec()));
        set
    }

    fn read(set: &DataSet) -> DataSet {
        let bytes = encode(set);
        parse(&bytes, bytes.len(), 0, EXPLICIT, Until::End).unwrap().set
    }

    #[test]
    fn a_sequence_that_came_as_unknown_with_its_length_is_one() {
        // Behind the headers of the sequence: 12 bytes explicit, 8 implicit.
        assert_eq!(read(&unknown(&encode_implicit(&known())[8..])), known());
        assert_eq!(read(&unknown(&encode(&known())[12..])), known());
        let none = read(&unknown(&[]));
        assert_eq!(none.get(tags::ROI_CONTOUR_SEQUENCE).unwrap().value, Value::Items(vec![]));
        // One within the other, and what is no sequence stays what it is.
        let mut outer = DataSet::default();
        outer.put_items(
            tags::REFERENCED_FRAME_OF_REFERENCE_SEQUENCE,
            vec![unknown(&encode(&known())[12..])],
        );
        let mut wanted = DataSet::default();
        wanted.put_items(tags::REFERENCED_FRAME_OF_REFERENCE_SEQUENCE, vec![known()]);
        assert_eq!(read(&outer), wanted);
        let raw = unknown(b"no items");
        assert_eq!(read(&raw), raw);
    }

    #[test]
    fn unknown_sequences_do_not_nest_for_ever() {
        let mut set = known();
        for _ in 0..200 {
            let mut outer = DataSet::default();
            let mut bytes = vec![0xFE, 0xFF, 0x00, 0xE0];
            let inner = encode(&set);
            bytes.extend((inner.len() as u32).to_le_bytes());
            bytes.extend(inner);
            outer.put(tags::ROI_CONTOUR_SEQUENCE, VR::UN, Value::Bytes(bytes));
            set = outer;
        }
        let _ends = read(&set);
    }
}
