"""A page of HTML: its elements are closed, and it has what an accessible page needs."""

from html.parser import HTMLParser

_VOID = {"meta", "img", "br", "link", "input", "hr", "source"}


class _Page(HTMLParser):
    def __init__(self):
        super().__init__()
        self.open, self.seen = [], {}

    def handle_starttag(self, tag, attributes):
        self.seen.setdefault(tag, []).append(dict(attributes))
        if tag not in _VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert tag in _VOID or self.open.pop() == tag, self.getpos()


def elements(text):
    """Attributes of its elements by tag; all must be closed."""
    page = _Page()
    page.feed(text)
    assert page.open == []
    return page.seen


def check_page(text):
    """Assert that elements are closed; that language, main, one h1 and alt texts are there."""
    seen = elements(text)
    assert seen["html"][0]["lang"]
    assert [len(seen[tag]) for tag in ("main", "h1")] == [1, 1]
    assert any(one.get("name") == "viewport" for one in seen["meta"])
    assert all(image["alt"] for image in seen.get("img", []))
    ids = [one["id"] for each in seen.values() for one in each if "id" in one]
    assert len(ids) == len(set(ids))
    targets = [one["href"] for one in seen.get("a", [])]
    assert all(target[1:] in ids for target in targets if target.startswith("#"))
