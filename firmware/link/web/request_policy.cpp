#include "link/web/request_policy.hpp"

#include <algorithm>
#include <functional>
#include <utility>

namespace lightwell {
namespace {

bool equal_ignoring_case(std::string_view a, std::string_view b) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return std::ranges::equal(a, b, {}, lower, lower);
}

/// The host and port of an origin; empty unless it is http:// or https://.
std::string_view authority_of(std::string_view origin) {
  for (const std::string_view scheme : {"https://", "http://"})
    if (origin.starts_with(scheme)) return origin.substr(scheme.size());
  return {};
}

/// Without the port, and an IPv6 address without brackets; empty if `host` is not HOST or HOST:PORT.
std::string_view host_name(std::string_view host) {
  const bool bracketed = host.starts_with('[');
  const std::size_t end = bracketed ? host.find(']') : host.find(':');
  if (bracketed && end == std::string_view::npos) return {};
  const std::string_view name = bracketed ? host.substr(1, end - 1) : host.substr(0, end);
  const std::string_view rest = host.substr(std::min(name.size() + (bracketed ? 2 : 0), host.size()));
  const bool is_port = rest.empty() || (rest.front() == ':' && rest.find_first_not_of("0123456789", 1) == rest.npos);
  return is_port ? name : std::string_view();
}

/// IPv6 addresses have colons and, like IPv4 addresses, no letter beyond f; the last label of a DNS name is not a
/// number (RFC 3696, section 2).
bool is_ip_address(std::string_view name) {
  if (name.empty()) return false;
  if (name.find(':') != std::string_view::npos) return name.find_first_not_of("0123456789abcdefABCDEF:.") == name.npos;
  return name.find_first_not_of("0123456789.") == name.npos;
}

}  // namespace

bool is_origin_allowed(std::string_view origin, std::string_view host, std::span<const std::string> allowed) {
  if (origin.empty()) return true;
  if (const std::string_view authority = authority_of(origin);
      !authority.empty() && equal_ignoring_case(authority, host))
    return true;
  return std::ranges::any_of(allowed, [&](const std::string& other) { return equal_ignoring_case(origin, other); });
}

bool is_host_trusted(std::string_view host, std::span<const std::string> allowed) {
  const std::string_view name = host_name(host);
  if (name.empty()) return false;
  if (is_ip_address(name) || name.find('.') == std::string_view::npos) return true;
  const std::size_t last_dot = name.rfind('.');
  if (equal_ignoring_case(name.substr(last_dot), ".local") || equal_ignoring_case(name.substr(last_dot), ".localhost"))
    return true;
  return std::ranges::any_of(
      allowed, [&](const std::string& origin) { return equal_ignoring_case(authority_of(origin), host); });
}

std::string_view content_type_of(std::string_view path) {
  static constexpr std::pair<std::string_view, std::string_view> kTypes[] = {
      {".html", "text/html; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".mjs", "text/javascript; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".json", "application/json"},
      {".svg", "image/svg+xml"},
      {".png", "image/png"},
      {".ico", "image/x-icon"},
      {".woff2", "font/woff2"},
      {".webmanifest", "application/manifest+json"},
      {".txt", "text/plain; charset=utf-8"}};
  for (const auto& [extension, type] : kTypes)
    if (path.ends_with(extension)) return type;
  return {};
}

TokenBucket& AuthenticationLimit::counter(std::string_view address) {
  return counters_[std::hash<std::string_view>()(address) % kCounters];
}

}  // namespace lightwell
