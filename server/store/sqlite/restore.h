// A backup in the place of the atlas of a daemon that does not run.
#pragma once

#include "core/base/status.h"
#include "server/store/backup_types.h"

namespace atlas {

// Reads all of the backup, copies it, begins a new epoch in the copy, notes an event, reads the
// copy back and puts it in its place. kNotFound: there is no backup. kInvalidArgument: it is no
// file, has a log beside it, is the target, or the target is no atlas.db. kInvalidData: it is no
// atlas, or damaged. kUnsupported: of another schema version. kConflict: a daemon runs there, or
// there is an atlas and it is not to be replaced. kResourceExhausted, kPermissionDenied,
// kUnavailable: the disk. After an error what was there is there; but see
// DataDirectory::restored_file().
Result<RestoredAtlas> RestoreAtlas(const RestoreOrder& order);

}  // namespace atlas
