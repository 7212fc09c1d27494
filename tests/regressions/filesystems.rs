//! Links, pipes, filesystems without locks, and several writers of one file.
