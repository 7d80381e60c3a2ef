#include "client/cli/command_line/command.h"

#include "client/cli/output/json_text.h"

namespace atlas {

Result<AtlasClient> CommandContext::Connect() const {
  ConnectionOptions options;
  options.endpoint = server;
  options.client_name = "atlas";
  return AtlasClient::Connect(options);
}

void CommandContext::PrintJson(const boost::json::object& object) const {
  out << JsonText(object) << '\n' << std::flush;
}

}  // namespace atlas
