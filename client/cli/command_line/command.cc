#include "client/cli/command_line/command.h"

#include "client/cli/output/json_text.h"

namespace atlas {

Result<AtlasClient> CommandContext::Connect() const {
  return AtlasClient::Connect(connection);
}

void CommandContext::PrintJson(const boost::json::object& object) const {
  out << JsonText(object) << '\n' << std::flush;
}

}  // namespace atlas
