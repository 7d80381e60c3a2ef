// Where a daemon listens.
#pragma once

#include <cstdint>
#include <string>

#include "core/base/status.h"

namespace atlas {

struct Endpoint {
  std::string host = "127.0.0.1";
  std::uint16_t port = 7447;

  // "HOST:PORT", "[IPV6]:PORT". kInvalidArgument otherwise.
  static Result<Endpoint> Parse(const std::string& text);
  std::string ToText() const;

  friend bool operator==(const Endpoint&, const Endpoint&) = default;
};

}  // namespace atlas
