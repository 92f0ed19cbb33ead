"""`golf-impact explore`: one impact under your hands, as a page in a browser.

A session (one tab) has an FMU instance of its own. `page.py` puts the page of a session together;
everything else here is a part of it, and none of them knows the page.
"""
