//! The elementary functions of the program for Windows: those of the system round otherwise than
//! musl's, which the program for Linux holds, and results would differ in the last bits, then in
//! whole voxels.
//!
//! Crate and C library call them by their names in C, so here they have these names; the linker
//! takes them before it looks into the system's libraries. `libm` is musl's in Rust. `unsafe` says
//! that a name is not mangled; nothing else is done.

#![allow(unsafe_code, reason = "names of C, see above")]

/// Functions of C by their name, their arguments, and what stands for them.
macro_rules! elementary {
    ($($name:ident($($x:ident),+: $number:ty) = $function:path;)+) => {$(
        // SAFETY: the function is the one that C has by this name.
        #[unsafe(no_mangle)]
        extern "C" fn $name($($x: $number),+) -> $number {
            $function($($x),+)
        }
    )+};
}

elementary! {
    acos(x: f64) = libm::acos;
    acosf(x: f32) = libm::acosf;
    asin(x: f64) = libm::asin;
    atan(x: f64) = libm::atan;
    atan2(y, x: f64) = libm::atan2;
    atan2f(y, x: f32) = libm::atan2f;
    cbrt(x: f64) = libm::cbrt;
    cos(x: f64) = libm::cos;
    cosf(x: f32) = libm::cosf;
    exp(x: f64) = libm::exp;
    expf(x: f32) = libm::expf;
    fma(x, y, z: f64) = libm::fma;
    fmaf(x, y, z: f32) = libm::fmaf;
    hypot(x, y: f64) = libm::hypot;
    _hypot(x, y: f64) = libm::hypot;
    hypotf(x, y: f32) = libm::hypotf;
    log(x: f64) = libm::log;
    log10(x: f64) = libm::log10;
    log2(x: f64) = libm::log2;
    log1p(x: f64) = libm::log1p;
    pow(x, y: f64) = libm::pow;
    powf(x, y: f32) = libm::powf;
    sin(x: f64) = libm::sin;
    sinf(x: f32) = libm::sinf;
    tan(x: f64) = libm::tan;
}

/// Both at once, as compilers ask for them; what C calls pointers to two numbers are these
/// references.
// SAFETY: the function is the one that C has by this name.
#[unsafe(no_mangle)]
extern "C" fn sincos(x: f64, sin: &mut f64, cos: &mut f64) {
    (*sin, *cos) = libm::sincos(x);
}

/// As [`sincos`].
// SAFETY: the function is the one that C has by this name.
#[unsafe(no_mangle)]
extern "C" fn sincosf(x: f32, sin: &mut f32, cos: &mut f32) {
    (*sin, *cos) = libm::sincosf(x);
}
