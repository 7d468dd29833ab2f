// What Winsock has taken over from POSIX: the resolver, and time-outs of poll().
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

// Winsock declares the same names. It comes before every other header of Windows.
#ifdef _WIN32
// clang-format off
#include <winsock2.h>
#include <ws2tcpip.h>
// clang-format on
#else
#include <netdb.h>

#include <sys/socket.h>
#endif

#include <lightwell/deleter.hpp>
#include <lightwell/host_names.hpp>
#include <lightwell/time.hpp>

namespace lightwell::platform {

/// numeric_addresses().
inline std::vector<std::string> resolved(const std::string& host, HostForm form) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = form == HostForm::numeric ? AI_NUMERICHOST : AI_ADDRCONFIG;
  addrinfo* first = nullptr;
  if (::getaddrinfo(host.c_str(), nullptr, &hints, &first) != 0) return {};
  const std::unique_ptr<addrinfo, Deleter<::freeaddrinfo>> found(first);
  std::vector<std::string> out;
  for (const addrinfo* a = first; a != nullptr; a = a->ai_next) {
    std::array<char, NI_MAXHOST> numeric{};
    if (::getnameinfo(a->ai_addr, static_cast<socklen_t>(a->ai_addrlen), numeric.data(),
                      static_cast<unsigned>(numeric.size()), nullptr, 0, NI_NUMERICHOST) == 0)
      out.emplace_back(numeric.data());
  }
  return out;
}

/// At least the time-out, so that a wait does not end before it; 0 for one that is over.
inline int poll_ms(Duration timeout) {
  constexpr std::int64_t kMillisecond = 1'000'000, kMaxMs = 1'000'000;
  return static_cast<int>(timeout.ns <= 0 ? 0 : std::min(timeout.ns / kMillisecond + 1, kMaxMs));
}

}  // namespace lightwell::platform
