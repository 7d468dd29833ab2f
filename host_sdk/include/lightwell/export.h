/* LW_API: what the library with the C interface exports. LW_BUILDS_LIBRARY is set where that library is compiled. */
#ifndef LIGHTWELL_EXPORT_H
#define LIGHTWELL_EXPORT_H

#if defined(_WIN32) && defined(LW_BUILDS_LIBRARY)
#define LW_API __declspec(dllexport)
#elif defined(_WIN32)
#define LW_API __declspec(dllimport)
#elif defined(__GNUC__)
#define LW_API __attribute__((visibility("default")))
#else
#define LW_API
#endif

#endif
