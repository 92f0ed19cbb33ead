"""The contact laws, one file each.

A law is a row of `LAWS`: a host chooses it by its number, and everything else in the package asks
the row. What a law must answer says `contact.Law`.
"""

from .absolute import AbsoluteLaw
from .contact import Law
from .relative import RelativeLaw

#: By the value of the parameter `law`.
LAWS: dict[int, Law] = {1: AbsoluteLaw(), 2: RelativeLaw()}
