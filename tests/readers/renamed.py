"""renamed.py OBJECT OUT: the same object of another patient."""

import sys

import pydicom

ds = pydicom.dcmread(sys.argv[1])
ds.PatientName, ds.PatientID = "Other^Person", "X77"
ds.save_as(sys.argv[2])
