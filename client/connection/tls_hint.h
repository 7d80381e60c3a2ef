// One end speaks TLS and the other does not: how that looks from here, and what to tell people.
#pragma once

#include <string_view>

#include <boost/system/error_code.hpp>

#include "core/base/bytes.h"

namespace atlas {

// Behind what went wrong where the daemon said nothing at all in the clear.
inline constexpr std::string_view kMayExpectTls = "; the daemon may expect TLS (--tls-ca)";

// What a daemon with TLS may answer to something else: an alert of any TLS (RFC 8446, sections 5.1
// and 6). No frame begins so.
bool IsTlsAlert(ByteSpan first_bytes);

// Behind a TLS handshake that ended so: that the daemon may not speak TLS. Else empty, as where it
// does and is not believed.
std::string_view MayNotSpeakTls(const boost::system::error_code& error);

}  // namespace atlas
