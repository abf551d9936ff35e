// Foreign libraries call our elementary functions in place of the C library's, whose last bits differ by the processor.
//
// A shared library calls sin, exp, pow, ... through a table of addresses, which the loader fills. This writes our
// functions into that table: of one library, after it was loaded, before it is used. ELF with explicit addends (x86-64,
// aarch64).
#pragma once

#include <dlfcn.h>
#include <elf.h>
#include <link.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "../../onboard/kernels/elementary.hpp"

namespace own {

namespace elementary = eldorado::elementary;

inline double log1p(double x) {
    const double u = 1.0 + x;
    return u == 1.0 ? x : elementary::log(u) * (x / (u - 1.0));
}

inline double expm1(double x) {
    const double u = elementary::exp(x);
    if (u == 1.0) return x;
    if (u - 1.0 == -1.0) return -1.0;
    return std::isinf(u) ? u : (u - 1.0) * (x / elementary::log(u));
}

// Whole powers by products, the others by exp(y log x): a few units in the last place for the powers of a bench.
inline double pow(double x, double y) {
    if (std::abs(y) <= 1024.0 && y == std::nearbyint(y)) {
        double out = 1.0, square = x;
        for (int n = static_cast<int>(std::abs(y)); n; n >>= 1, square *= square)
            if (n & 1) out *= square;
        return y < 0.0 ? 1.0 / out : out;
    }
    if (x == 0.0) return y > 0.0 ? 0.0 : y < 0.0 ? elementary::kInf : elementary::kNan;
    return x == 1.0 ? 1.0 : elementary::exp(y * elementary::log(x));
}

inline void sincos(double x, double* sine, double* cosine) {
    *sine = elementary::sin(x);
    *cosine = elementary::cos(x);
}

// The same of float: of the double, rounded.
template <double (*function)(double)>
float single(float x) {
    return static_cast<float>(function(x));
}
template <double (*function)(double, double)>
float single_of_two(float x, float y) {
    return static_cast<float>(function(x, y));
}
inline void sincosf(float x, float* sine, float* cosine) {
    *sine = single<elementary::sin>(x);
    *cosine = single<elementary::cos>(x);
}

struct Function {
    const char* name;
    void* address;
};

template <typename T>
void* address(T* function) {
    return reinterpret_cast<void*>(function);
}

inline const std::vector<Function>& functions() {
    namespace e = elementary;
    static const std::vector<Function> table = {
        {"sin", address(e::sin)}, {"sinf", address(single<e::sin>)},
        {"cos", address(e::cos)}, {"cosf", address(single<e::cos>)},
        {"tan", address(e::tan)}, {"tanf", address(single<e::tan>)},
        {"asin", address(e::asin)}, {"asinf", address(single<e::asin>)},
        {"acos", address(e::acos)}, {"acosf", address(single<e::acos>)},
        {"atan", address(e::atan)}, {"atanf", address(single<e::atan>)},
        {"atan2", address(e::atan2)}, {"atan2f", address(single_of_two<e::atan2>)},
        {"exp", address(e::exp)}, {"expf", address(single<e::exp>)},
        {"log", address(e::log)}, {"logf", address(single<e::log>)},
        {"expm1", address(expm1)}, {"expm1f", address(single<expm1>)},
        {"log1p", address(log1p)}, {"log1pf", address(single<log1p>)},
        {"pow", address(pow)}, {"powf", address(single_of_two<pow>)},
        {"hypot", address(e::hypot)}, {"hypotf", address(single_of_two<e::hypot>)},
        {"sincos", address(sincos)}, {"sincosf", address(sincosf)},
    };
    return table;
}

// Each entry of a loaded library's tables that is one of ours: its name and where it stands.
template <typename Visit>
void entries(const link_map* library, Visit visit) {
    const auto at = [library](ElfW(Addr) value) {  // the loader has made some of them absolute
        return value < library->l_addr ? value + library->l_addr : value;
    };
    ElfW(Addr) tables[2] = {0, 0};
    std::size_t sizes[2] = {0, 0};
    const ElfW(Sym)* symbols = nullptr;
    const char* names = nullptr;
    for (const ElfW(Dyn)* row = library->l_ld; row->d_tag != DT_NULL; ++row) {
        switch (row->d_tag) {
            case DT_JMPREL: tables[0] = at(row->d_un.d_ptr); break;
            case DT_PLTRELSZ: sizes[0] = row->d_un.d_val; break;
            case DT_RELA: tables[1] = at(row->d_un.d_ptr); break;
            case DT_RELASZ: sizes[1] = row->d_un.d_val; break;
            case DT_SYMTAB: symbols = reinterpret_cast<const ElfW(Sym)*>(at(row->d_un.d_ptr)); break;
            case DT_STRTAB: names = reinterpret_cast<const char*>(at(row->d_un.d_ptr)); break;
        }
    }
    for (int k = 0; k < 2; ++k) {
        const auto* first = reinterpret_cast<const ElfW(Rela)*>(tables[k]);
        for (const auto* entry = first; entry < first + sizes[k] / sizeof(ElfW(Rela)); ++entry) {
            const ElfW(Sym)& symbol = symbols[ELF64_R_SYM(entry->r_info)];
            if (symbol.st_shndx != SHN_UNDEF || entry->r_addend != 0 || ELF64_R_SYM(entry->r_info) == 0) continue;
            visit(names + symbol.st_name, reinterpret_cast<void**>(library->l_addr + entry->r_offset));
        }
    }
}

// Names of the functions that the library at `path` now has from us. Empty `why`: it went well.
inline std::vector<std::string> give(const char* path, std::string& why) {
    std::vector<std::string> given;
    void* handle = dlopen(path, RTLD_LAZY | RTLD_NOLOAD);
    link_map* library = nullptr;
    if (!handle || dlinfo(handle, RTLD_DI_LINKMAP, &library) != 0) {
        why = "it is not loaded";
        return given;
    }
    const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
    entries(library, [&](const char* name, void** entry) {
        for (const Function& ours : functions()) {
            if (std::strcmp(ours.name, name) != 0) continue;
            const std::uintptr_t start = reinterpret_cast<std::uintptr_t>(entry) & ~(page - 1);
            if (mprotect(reinterpret_cast<void*>(start), page, PROT_READ | PROT_WRITE) != 0) {
                why = "its table cannot be written";
                return;
            }
            *entry = ours.address;
            given.emplace_back(name);
        }
    });
    dlclose(handle);
    return given;
}

}  // namespace own
