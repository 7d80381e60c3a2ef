// A text as a JSON string (RFC 8259), whatever its bytes.
#pragma once

#include <string>
#include <string_view>

namespace atlas {

// Appends it with its quotes. What is no UTF-8 becomes U+FFFD.
void AppendJsonString(std::string_view text, std::string& out);

}  // namespace atlas
