// Discovery by DNS-SD through this machine's avahi-daemon.
#include <algorithm>
#include <string>
#include <vector>

#include <avahi-client/client.h>
#include <avahi-client/lookup.h>
#include <avahi-common/error.h>
#include <avahi-common/simple-watch.h>
#include <avahi-common/strlst.h>

#include <lightwell/advertisement.hpp>
#include <lightwell/printable.hpp>

#include "core/discovery_backends.hpp"

namespace lightwell::core {
namespace {

/// Limit of concurrent resolvers, against floods of services; the others are only counted.
constexpr std::size_t kMaxResolvers = 4 * DiscoveryResults::kMaxProbes;

class Browser {
 public:
  explicit Browser(DiscoveryResults& results) : results_(results), poll_(avahi_simple_poll_new()) {}
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;
  ~Browser() {
    if (client_ != nullptr) avahi_client_free(client_);  // frees browser and resolvers, too
    if (poll_ != nullptr) avahi_simple_poll_free(poll_);
  }

  void run(Duration timeout) {
    int error = 0;
    if (poll_ != nullptr)
      client_ = avahi_client_new(avahi_simple_poll_get(poll_), AvahiClientFlags{}, on_client, this, &error);
    if (client_ == nullptr) return say(error);
    if (avahi_service_browser_new(client_, AVAHI_IF_UNSPEC, AVAHI_PROTO_UNSPEC, kServiceType.data(), nullptr,
                                  AvahiLookupFlags{}, on_service, this) == nullptr)
      return say(avahi_client_errno(client_));
    const std::int64_t end = monotonic_now_ns() + timeout.ns;
    while (!failed_) {
      const std::int64_t left = end - monotonic_now_ns();
      if (left <= 0) return;
      constexpr std::int64_t kSlice = 200'000'000;
      if (avahi_simple_poll_iterate(poll_, static_cast<int>(std::min(left, kSlice) / 1'000'000 + 1)) != 0)
        return say(AVAHI_ERR_DISCONNECTED);
    }
  }

 private:
  void say(int error) {
    results_.problem("mDNS: " + std::string(avahi_strerror(error)) + "; is avahi-daemon running on this machine?");
  }

  static void on_client(AvahiClient* client, AvahiClientState state, void* data) {
    auto& self = *static_cast<Browser*>(data);
    if (state != AVAHI_CLIENT_FAILURE) return;
    self.say(avahi_client_errno(client));
    self.failed_ = true;
  }

  static void on_service(AvahiServiceBrowser* browser, AvahiIfIndex interface, AvahiProtocol protocol,
                         AvahiBrowserEvent event, const char* name, const char* type, const char* domain,
                         AvahiLookupResultFlags, void* data) {
    auto& self = *static_cast<Browser*>(data);
    if (event == AVAHI_BROWSER_FAILURE) {
      self.say(avahi_client_errno(avahi_service_browser_get_client(browser)));
      self.failed_ = true;
    } else if (event == AVAHI_BROWSER_REMOVE) {
      self.results_.remove(key(name, domain));
    } else if (event == AVAHI_BROWSER_NEW) {
      // A service is announced on every interface and protocol with the same content; the first is used.
      if (++self.resolvers_ > kMaxResolvers ||
          avahi_service_resolver_new(self.client_, interface, protocol, name, type, domain, AVAHI_PROTO_UNSPEC,
                                     AvahiLookupFlags{}, on_resolved, data) == nullptr)
        self.results_.refuse();
    }
  }

  static void on_resolved(AvahiServiceResolver* resolver, AvahiIfIndex, AvahiProtocol, AvahiResolverEvent event,
                          const char* name, const char*, const char* domain, const char* host, const AvahiAddress*,
                          std::uint16_t, AvahiStringList* txt, AvahiLookupResultFlags, void* data) {
    auto& self = *static_cast<Browser*>(data);
    if (event == AVAHI_RESOLVER_FOUND) self.found(name, domain, host, txt);
    avahi_service_resolver_free(resolver);
  }

  void found(const char* name, const char* domain, const char* host, AvahiStringList* txt) {
    std::vector<std::string> entries;
    for (AvahiStringList* at = txt; at != nullptr; at = avahi_string_list_get_next(at))
      entries.emplace_back(reinterpret_cast<const char*>(avahi_string_list_get_text(at)),
                           avahi_string_list_get_size(at));
    const Result<Advertisement> advertisement = advertisement_from_txt(entries);
    const std::string machine = host;
    if (!advertisement.ok() || !is_machine(machine)) return results_.refuse();
    FoundProbe probe;
    probe.by = FoundBy::mdns;
    probe.name = advertisement->name;
    probe.id = advertisement->probe_id;
    probe.calibration_id = advertisement->calibration_id;
    probe.version = advertisement->version;
    probe.wire_version = advertisement->wire_version;
    probe.instance = printable(name);
    probe.host = machine;
    for (const AdvertisedLink& link : advertisement->links) {
      std::string uri = link.uri;
      if (const std::size_t at = uri.find("://:"); at != std::string::npos) uri.insert(at + 3, machine);
      probe.links.push_back({uri, link.security});
    }
    results_.put(key(name, domain), std::move(probe));
  }

  /// The host as part of a URI.
  static bool is_machine(const std::string& host) {
    return !host.empty() && host.size() <= 255 && std::ranges::all_of(host, [](unsigned char c) {
      return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' || c == '.' ||
             c == '_';
    });
  }

  static std::string key(const char* name, const char* domain) { return std::string("mdns ") + domain + " " + name; }

  DiscoveryResults& results_;
  AvahiSimplePoll* const poll_;
  AvahiClient* client_ = nullptr;
  std::size_t resolvers_ = 0;
  bool failed_ = false;
};

}  // namespace

void discover_by_mdns(Duration timeout, DiscoveryResults& results) { Browser(results).run(timeout); }

}  // namespace lightwell::core
