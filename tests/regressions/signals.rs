//! Signals end every command promptly, and stop requests are never lost.
