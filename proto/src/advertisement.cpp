#include <charconv>
#include <optional>

#include <lightwell/advertisement.hpp>
#include <lightwell/text.hpp>

namespace lightwell {
namespace {

constexpr std::size_t kMaxLinks = 8;
constexpr std::size_t kMaxStrings = 64;
/// Limit of one string of a TXT record, bytes (RFC 6763, section 6.1).
constexpr std::size_t kMaxEntry = 255;
constexpr std::size_t kMaxName = 64;
constexpr std::size_t kMaxVersion = 32;

Status wrong(std::string_view key, std::string_view why) {
  return invalid_argument("TXT record: " + std::string(key) + ": " + std::string(why));
}

std::string hex(std::uint32_t value) { return formatted("%08x", value); }

std::optional<std::uint32_t> number(std::string_view text, int base) {
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// scheme://[host][:port][/topic], printable ASCII without space: safe to display; a connection checks it further.
bool is_link(std::string_view uri) {
  const std::size_t scheme = uri.find("://");
  if (scheme == std::string_view::npos || scheme == 0 || scheme > 16 || uri.size() <= scheme + 3) return false;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    const auto c = static_cast<unsigned char>(uri[i]);
    if (c <= 0x20 || c >= 0x7F) return false;
    if (i < scheme && !(c >= 'a' && c <= 'z')) return false;
  }
  return true;
}

}  // namespace

AdvertisedLink advertised_link(std::string_view address) {
  const std::size_t scheme_end = address.find("://");
  if (scheme_end == std::string_view::npos) return {};
  const std::string_view scheme = address.substr(0, scheme_end);
  const std::string security = scheme != "ws" && scheme.ends_with('s') ? "tls" : "none";
  const std::string_view rest = address.substr(scheme_end + 3);
  // An MQTT broker is another machine; its address is advertised as configured.
  if (scheme.starts_with("mqtt")) return {std::string(address), security};
  const std::size_t colon = rest.rfind(':');
  if (colon == std::string_view::npos) return {};
  std::string_view host = rest.substr(0, colon);
  if (host.starts_with("127.") || host == "localhost" || host == "[::1]") return {};
  if (host == "0.0.0.0" || host == "[::]") host = {};
  return {std::string(scheme) + "://" + std::string(host) + std::string(rest.substr(colon)), security};
}

std::vector<std::string> advertisement_to_txt(const Advertisement& a) {
  std::vector<std::string> txt = {"txtvers=1",
                                  "id=" + hex(a.probe_id),
                                  "name=" + a.name,
                                  "version=" + a.version,
                                  "cal=" + hex(a.calibration_id),
                                  "wire=" + std::to_string(a.wire_version)};
  std::size_t i = 0;
  for (const AdvertisedLink& link : a.links) {
    const std::string number_of_link = std::to_string(i);
    const std::string entry = "link" + number_of_link + "=" + link.uri;
    if (link.uri.empty() || entry.size() > kMaxEntry || i == kMaxLinks) continue;
    txt.push_back(entry);
    txt.push_back("sec" + number_of_link + "=" + link.security);
    ++i;
  }
  return txt;
}

Result<Advertisement> advertisement_from_txt(const std::vector<std::string>& txt) {
  if (txt.size() > kMaxStrings) return wrong("TXT", "more than 64 strings");
  const auto value = [&](const std::string& key) -> std::optional<std::string_view> {
    for (const std::string& entry : txt)
      if (entry.size() <= kMaxEntry && entry.starts_with(key + "="))
        return std::string_view(entry).substr(key.size() + 1);
    return std::nullopt;
  };
  if (value("txtvers") != "1") return wrong("txtvers", "it must be 1");
  Advertisement out;
  for (const auto& [key, target] : {std::pair{"id", &out.probe_id}, {"cal", &out.calibration_id}}) {
    const auto text = value(key);
    const auto parsed = text && text->size() == 8 ? number(*text, 16) : std::nullopt;
    if (!parsed) return wrong(key, "it must be eight hexadecimal digits");
    *target = *parsed;
  }
  const auto wire = value("wire");
  const auto wire_number = wire ? number(*wire, 10) : std::nullopt;
  if (!wire_number || *wire_number == 0) return wrong("wire", "it must be a number, at least 1");
  out.wire_version = *wire_number;
  const auto name = value("name");
  if (!name || name->empty() || name->size() > kMaxName) return wrong("name", "it must have 1 to 64 bytes");
  if (printable(*name) != *name) return wrong("name", "it has control characters or is not UTF-8");
  out.name = *name;
  const auto version = value("version");
  if (!version || version->empty() || version->size() > kMaxVersion)
    return wrong("version", "it must have 1 to 32 characters");
  for (const char c : *version)
    if (!((c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '.' || c == '-' ||
          c == '+' || c == '~'))
      return wrong("version", "it has a character that is not allowed in versions");
  out.version = *version;
  for (std::size_t i = 0; i < kMaxLinks; ++i) {
    const std::string key = "link" + std::to_string(i);
    const auto link = value(key);
    if (!link) break;
    if (!is_link(*link)) return wrong(key, "it must be SCHEME://[HOST]:PORT or a broker's address");
    const auto security = value("sec" + std::to_string(i));
    if (security != "none" && security != "tls") return wrong("sec" + std::to_string(i), "it must be none or tls");
    out.links.push_back({std::string(*link), std::string(*security)});
  }
  return out;
}

}  // namespace lightwell
