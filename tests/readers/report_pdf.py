"""report_pdf.py RUN [SOURCE]: the report of a run as an Encapsulated PDF says what its summary, its page and its series say.

Other readers take the PDF apart: pypdf, which has to find every object, text and pixel, and pdftotext and qpdf where they are
installed. Of a de-identified run SOURCE is the CT whose patient must not be named; else the patient of RUN/ct must be."""

import io
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pydicom
import pypdf
from grids import check
from PIL import Image

HEADLINES = {"green": "Green: within the tolerance", "amber": "Amber: look before use.", "red": "Red: do not use."}
run, source = Path(sys.argv[1]), [Path(path) for path in sys.argv[2:]]
found = pydicom.dcmread(run / "report.dcm")
slices = [pydicom.dcmread(path, stop_before_pixels=True) for path in sorted((run / "ct").iterdir())]
ct, summary = slices[0], json.loads((run / "summary.json").read_text())

check(found.SOPClassUID == "1.2.840.10008.5.1.4.1.1.104.1", f"class {found.SOPClassUID}")
for name in ("PatientName", "PatientID", "PatientBirthDate", "StudyInstanceUID", "StudyDate", "SeriesDate", "SeriesTime"):
    check(found.get(name) == ct.get(name), f"{name} is not that of the series")
check((found.ContentDate, found.ContentTime) == (ct.SeriesDate, ct.SeriesTime), "another date than the series")
check(found.SeriesInstanceUID != ct.SeriesInstanceUID and found.SeriesNumber == ct.SeriesNumber + 4, "no series of its own")
check((found.Modality, found.ConversionType) == ("DOC", "WSD"), "modality or conversion")
check(found.MIMETypeOfEncapsulatedDocument == "application/pdf", "MIME type")
check(found.BurnedInAnnotation == ("NO" if source else "YES"), f"burned in: {found.BurnedInAnnotation}")
named = {item.ReferencedSOPInstanceUID for item in found.SourceInstanceSequence}
original = {item.ReferencedSOPInstanceUID for one in slices for item in one.SourceImageSequence}
check(len(named) == len(slices) and original <= named, "the slices of the CT are not named")
whole, length = found.EncapsulatedDocument, found.EncapsulatedDocumentLength
check(len(whole) % 2 == 0 and len(whole) - length < 2, f"{length} of {len(whole)} bytes")
check("report.dcm" in [output["path"] for output in summary["outputs"]], "the summary does not list it")

pdf = whole[:length]
pages = pypdf.PdfReader(io.BytesIO(pdf), strict=True).pages
check(len(pages) <= 2, f"{len(pages)} pages")
check(all(np.allclose(page.mediabox[2:], (595.28, 841.89)) for page in pages), "not A4")
texts = [" ".join(page.extract_text().split()) for page in pages]
text = " ".join(texts)
tumour, interval = summary["tumour"], summary["tumour_interval"]
low, high = interval["length_mm"]
for wanted in (
    HEADLINES[summary["verdict"]["colour"]],
    f"The tumour moves {tumour['distance_mm']:.1f} mm (95 %: {low:.1f} to {high:.1f} mm)",
    f"Result {summary['id']}",
    f"{summary['position']['breast'].capitalize()} breast on the operating table",
    f"{summary['tool']['name']} {summary['tool']['version']}",
    f"Young's modulus {summary['parameters']['tissue']['young_kpa']:g} kPa",
    ct.SeriesDescription,
    "DERIVED, SIMULATED IMAGES.",
):
    check(wanted in text, f"{wanted!r} is not in {text!r}")
check(all(f"Result {summary['id']}" in text and "DERIVED" in text for text in texts), "a page without result or warning")
places = [text.find(f" {n + 1}. ") for n in range(len(summary["verdict"]["reasons"]))]
check(-1 not in places and places == sorted(places), f"reasons at {places}")
for reason in summary["verdict"]["reasons"]:
    words = reason["message"].replace("\u202f", "\u00a0").split()[-4:]
    check(" ".join(words) in text, f"{words} is not in the text")

patient = pydicom.dcmread(min(source[0].iterdir()), stop_before_pixels=True) if source else ct
for word in (str(patient.PatientName).split("^")[0], str(patient.PatientID)):
    inside = [word in page for page in texts]
    check(len(word) > 3 and not any(inside) if source else all(inside), f"{word!r}: {inside}")

shown = [np.array(image.image.convert("RGB")) for page in pages for image in page.images]
check(len(shown) == 3, f"{len(shown)} pictures")
for picture, name in zip(shown, ("before", "after", "change")):
    meant = np.array(Image.open(run / f"report/axial_{name}.png").convert("RGB"))
    check(np.array_equal(picture, meant), f"the picture {name} is not that of the page")

with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "report.pdf"
    path.write_bytes(pdf)
    said = []
    if shutil.which("qpdf"):
        subprocess.run(["qpdf", "--check", path], check=True, stdout=subprocess.DEVNULL)
        said.append("qpdf")
    if shutil.which("pdftotext"):
        read = subprocess.run(["pdftotext", path, "-"], check=True, capture_output=True, text=True).stdout
        check(f"Result {summary['id']}" in " ".join(read.split()), "pdftotext finds no result")
        said.append("pdftotext")
print(f"{len(pages)} pages, {length} bytes, {len(text.split())} words; pypdf {' '.join(said)}")
