// Avahi's client library, loaded when multicast DNS is used: the SDK runs without it on machines that have no Avahi.
#pragma once

#include <avahi-client/client.h>
#include <avahi-client/lookup.h>
#include <avahi-common/address.h>
#include <avahi-common/error.h>
#include <avahi-common/simple-watch.h>
#include <avahi-common/strlst.h>

#include <lightwell/result.hpp>

namespace lightwell::core {

// Those of libavahi-common are found by way of libavahi-client, which needs it.
#define LIGHTWELL_AVAHI_FUNCTIONS(F) \
  F(address_snprint)                 \
  F(client_errno)                    \
  F(client_free)                     \
  F(client_new)                      \
  F(host_name_resolver_new)          \
  F(service_browser_get_client)      \
  F(service_browser_new)             \
  F(service_resolver_free)           \
  F(service_resolver_new)            \
  F(simple_poll_free)                \
  F(simple_poll_get)                 \
  F(simple_poll_iterate)             \
  F(simple_poll_new)                 \
  F(strerror)                        \
  F(string_list_get_next)            \
  F(string_list_get_size)            \
  F(string_list_get_text)

/// Avahi's functions, without the prefix avahi_.
struct AvahiLibrary {
#define LIGHTWELL_AVAHI_MEMBER(name) decltype(&avahi_##name) name;
  LIGHTWELL_AVAHI_FUNCTIONS(LIGHTWELL_AVAHI_MEMBER)
#undef LIGHTWELL_AVAHI_MEMBER

  /// Loads the library at the first call, for as long as the process runs. Any thread. `unavailable` if this machine
  /// does not have it; not looked for again.
  static const Result<AvahiLibrary>& loaded();
};

}  // namespace lightwell::core
