// A library with the two functions of liblightwell that `lightwell doctor` calls, of version LIBRARY_ABI; without it,
// one that ends its process when it is loaded.
#include <cstdint>
#include <cstdlib>

#ifdef LIBRARY_ABI
extern "C" {
std::uint32_t lw_abi_version();
const char* lw_version();

std::uint32_t lw_abi_version() { return LIBRARY_ABI; }
const char* lw_version() { return "9.9.9"; }
}
#else
__attribute__((constructor)) static void crash() { std::abort(); }
#endif
