// Atlases that `atlas-merge run` reads sessions of.
#pragma once

#include <memory>
#include <string>

#include "client/cli/command_line/command.h"
#include "client/merge/source/session_source.h"
#include "core/base/status.h"

namespace atlas {

// kNotFound: there is no such file. Else as AtlasFile::Open.
Result<std::unique_ptr<SessionSource>> OpenFileSessions(const std::string& file);
// A file, or HOST:PORT of a daemon, which is spoken to as the command's own is. kNotFound: it is
// neither.
Result<std::unique_ptr<SessionSource>> OpenSessions(const std::string& from,
                                                    const CommandContext& context);

}  // namespace atlas
