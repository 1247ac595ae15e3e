//! End-to-end tests and conformance suites; the tests are in the files beside.
