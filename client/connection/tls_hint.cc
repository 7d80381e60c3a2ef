#include "client/connection/tls_hint.h"

#include <boost/asio/error.hpp>
#include <boost/asio/ssl.hpp>  // and OpenSSL's reasons

namespace atlas {

namespace asio = boost::asio;

bool IsTlsAlert(ByteSpan first_bytes) {
  constexpr std::uint8_t kAlert = 21;
  constexpr std::uint8_t kVersion3 = 3;
  return first_bytes.size() >= 2 && first_bytes[0] == kAlert && first_bytes[1] == kVersion3;
}

std::string_view MayNotSpeakTls(const boost::system::error_code& error) {
  const bool is_other_protocol =
      error.category() == asio::error::get_ssl_category() &&
      ERR_GET_REASON(static_cast<unsigned long>(error.value())) == SSL_R_WRONG_VERSION_NUMBER;
  const bool is_end = error == asio::error::eof || error == asio::error::connection_reset ||
                      error == asio::ssl::error::stream_truncated;
  return is_other_protocol || is_end ? "; the daemon may not speak TLS (no --tls-ca)" : "";
}

}  // namespace atlas
