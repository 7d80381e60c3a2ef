#include "client/connection/endpoint.h"

#include <charconv>

#include "core/base/str_cat.h"

namespace atlas {

Result<Endpoint> Endpoint::Parse(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  const auto failure = Error(StatusCode::kInvalidArgument,
                             StrCat("server '", text.substr(0, 200), "': expected HOST:PORT"));
  if (colon == std::string::npos || colon == 0) return failure;
  Endpoint endpoint;
  endpoint.host = text.substr(0, colon);
  if (endpoint.host.front() == '[' && endpoint.host.back() == ']') {
    endpoint.host = endpoint.host.substr(1, endpoint.host.size() - 2);
  }
  const char* end = text.data() + text.size();
  const auto [position, error] = std::from_chars(text.data() + colon + 1, end, endpoint.port);
  if (error != std::errc() || position != end || endpoint.port == 0 || endpoint.host.empty()) {
    return failure;
  }
  return endpoint;
}

std::string Endpoint::ToText() const {
  const bool is_ipv6 = host.find(':') != std::string::npos;
  return is_ipv6 ? StrCat('[', host, "]:", port) : StrCat(host, ':', port);
}

}  // namespace atlas
