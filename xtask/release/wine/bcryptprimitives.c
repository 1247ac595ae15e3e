/* Windows has a library bcryptprimitives.dll, of which Rust's standard library takes its random numbers; Wine of
   Debian 12 has none. This stands in for it when the program for Windows is tried, and is never given out. */

typedef unsigned char BOOLEAN;
__declspec(dllimport) BOOLEAN SystemFunction036(void *buffer, unsigned long bytes);

__declspec(dllexport) int ProcessPrng(unsigned char *buffer, unsigned long long bytes) {
    return SystemFunction036(buffer, (unsigned long)bytes);
}
