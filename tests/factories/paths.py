"""Paths that could lead out of their folder, on one system or another."""

from hypothesis import strategies as st

BAD = {
    "": "is empty",
    "x" * 201: "longer than 200",
    "/etc/passwd": "is absolute",
    "//host/share": "is absolute",
    "C:/x": "is absolute",
    "c:x": "is absolute",
    "..": "leads out",
    "a/../b": "leads out",
    "a/..": "leads out",
    "a\\..\\b": "holds \\",
    "\\\\host": "holds \\",
    "a\0b": "control characters",
    "a\nb": "control characters",
    "a\u202eb": "control characters",
    "\ud800": "control characters",
    "a//b": "empty",
    "./a": "empty",
    "a/.": "empty",
    "a/": "empty",
    "a./b": "space or dot",
    "a /b": "space or dot",
    "a/ b": "space or dot",
    "file:stream": "holds :",
    "a*": "holds *",
    "NUL": "names a device",
    "a/com1.txt": "names a device",
    "aux": "names a device",
}
PATHS = st.one_of(
    st.text(max_size=30),
    st.text("./\\:aA ~\0C", max_size=12),
    st.lists(st.sampled_from(["..", ".", "", "a", "CON", "b:", "~", "…"]), max_size=5).map(
        "/".join
    ),
)
